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
    with temporary_files.temp_output(outputs, name, ".exr", failures=(RuntimeError,)) as path:
        package.File(header, {"RGB": np.ascontiguousarray(pixels)}).write(path)


def read(inputs: Inputs, name: str, *, width: int, height: int) -> AnyArray:
    """Return the pixels (height, width, 3). Raises FormatError for an invalid file or another size."""
    package = _package()
    with temporary_files.temp_input(inputs, name, ".exr") as path, temporary_files.silence_native():
        try:
            with package.File(path, header_only=True) as file:
                found = _size(file.header())
            if found != (width, height):
                raise FormatError(f"EXR has {found[0]} × {found[1]} pixels (expected {width} × {height})")
            with package.File(path) as file:
                channels = file.channels()
                if "RGB" in channels:
                    pixels = np.array(channels["RGB"].pixels)  # a copy: the array is invalid once the file is closed
                else:
                    pixels = np.stack([np.array(channels[key].pixels) for key in "RGB"], axis=-1)
        except (KeyError, IndexError):
            raise FormatError("EXR has no channels R, G and B") from None
        except (RuntimeError, ValueError, TypeError, OSError) as error:
            raise FormatError(f"is no EXR that can be read ({' '.join(str(error).split())[:80]})") from None
    if pixels.shape != (height, width, 3):
        raise FormatError("EXR has channels of different sizes")
    return pixels


def _size(header: dict[str, Any]) -> tuple[int, int]:
    """Width and height of an image; its channels are sampled at every pixel."""
    (left, top), (right, bottom) = (np.asarray(corner).tolist() for corner in header["dataWindow"])
    return right - left + 1, bottom - top + 1


def _package() -> Any:
    try:
        import OpenEXR
    except ImportError:
        raise UnsupportedError("EXR needs the package OpenEXR", help="pip install 'gltf-anim[exr]'") from None
    return OpenEXR
