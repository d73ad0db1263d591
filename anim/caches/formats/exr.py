"""EXR of three channels ↔ pixel arrays, through OpenEXR (extra `exr`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.arrays import AnyArray
from anim.caches import temporary_files
from anim.caches.storage import Inputs, Outputs
from anim.errors import FormatError, UnsupportedError

TYPES = {"float": np.float32, "half": np.float16}


def write(pixels: AnyArray, outputs: Outputs, name: str) -> None:
    """Write pixels (height, width, 3), float32 or float16, as R, G, B; losslessly compressed (ZIP)."""
    package = _package()
    header = {"compression": package.ZIP_COMPRESSION, "type": package.scanlineimage}
    with temporary_files.temp_output(outputs, name, ".exr") as path:
        package.File(header, {"RGB": np.ascontiguousarray(pixels)}).write(path)


def read(inputs: Inputs, name: str) -> AnyArray:
    """Return the pixels (height, width, 3). Raises FormatError for an invalid file."""
    package = _package()
    with temporary_files.temp_input(inputs, name, ".exr") as path, temporary_files.silence_native():
        try:
            with package.File(path) as file:
                channels = file.channels()
                if "RGB" in channels:
                    return np.array(channels["RGB"].pixels)  # a copy: the array is invalid once the file is closed
                return np.stack([np.array(channels[key].pixels) for key in "RGB"], axis=-1)
        except KeyError:
            raise FormatError("EXR has no channels R, G and B") from None
        except (RuntimeError, ValueError, OSError) as error:
            raise FormatError(f"is no EXR that can be read ({' '.join(str(error).split())[:80]})") from None


def _package() -> Any:
    try:
        import OpenEXR
    except ImportError:
        raise UnsupportedError("EXR needs the package OpenEXR", help="pip install 'gltf-anim[exr]'") from None
    return OpenEXR
