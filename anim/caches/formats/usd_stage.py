"""Files of a stage: .usdc, .usda and .usdz with images, its metadata, and arrays; through usd-core (extra `usd`)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import nullcontext
from typing import Any, TypeAlias, TypeVar

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches import temporary_files
from anim.caches.formats.usd_package import write_package
from anim.caches.storage import Outputs, companion_name
from anim.errors import UnsupportedError
from anim.files.signals import hold_signals

ROOT, MATERIALS = "/root", "/root/materials"
USUAL_FPS = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)  # frame rates tried, in this order
FRAME_TOLERANCE = 1e-3  # of a frame
SaveImage: TypeAlias = Callable[[int, str, bytes], str]  # index in the document, file extension, bytes → path
T = TypeVar("T")


def package() -> tuple[Any, Any, Any]:
    """Return usd-core's Usd, UsdGeom and Vt. Raises UnsupportedError if it is not installed."""
    is_loaded = "pxr.UsdSkel" in sys.modules  # asked for with every array
    try:
        # What a signal raises while these load is lost, or leaves half of them
        with nullcontext() if is_loaded else hold_signals():
            from pxr import Gf, Tf, Usd, UsdGeom, UsdSkel, Vt  # noqa: F401
    except ImportError:
        raise UnsupportedError("USD needs the package usd-core", help="pip install 'gltf-anim[usd]'") from None
    return Usd, UsdGeom, Vt


def write_stage(outputs: Outputs, ending: str, name: str, build: Callable[[Any, SaveImage], T]) -> T:
    """Write a stage that `build` fills, and its images; return the result of `build`.

    ending: ".usdc" binary, ".usda" text, or ".usdz", a package with the images and the stage as `name`; otherwise the
    images are beside it. build: keeps no reference to the stage, and holds signals while usd-core works, which
    discards what a signal raises inside the Python that it calls. Raises UnsupportedError without usd-core.
    """
    usd, _, _ = package()
    from pxr import Tf

    images: list[tuple[str, bytes]] = []

    def save_image(number: int, kind: str, data: bytes) -> str:
        own = f"image{number}{kind}"
        images.append((own if ending == ".usdz" else companion_name(outputs.main, f"-{own}"), data))
        return images[-1][0] if ending == ".usdz" else f"./{images[-1][0]}"

    with temporary_files.temp_output(outputs, outputs.main, ending, failures=(Tf.ErrorException,)) as path:
        binary = path if ending == ".usdc" else f"{path}.usdc"
        with hold_signals():
            stage = usd.Stage.CreateNew(binary)
        result = build(stage, save_image)
        with hold_signals():
            stage.GetRootLayer().Save()
            if ending == ".usda":
                stage.GetRootLayer().Export(path)
            elif ending == ".usdz":
                del stage
                write_package(path, binary, images, name=name)
    for image, data in images if ending != ".usdz" else ():
        with outputs.create(image) as file:
            file.write(data)
    return result


def define_prims(stage: Any, prims: Iterable[tuple[str, str]]) -> None:
    """Define prims, (path, type name) each, in one change: usd-core composes all siblings anew after each change.

    Those in an edit of their own take time in proportion to the square of the siblings.
    """
    from pxr import Sdf

    layer = stage.GetRootLayer()
    with Sdf.ChangeBlock():
        for path, kind in prims:
            spec = Sdf.CreatePrimInLayer(layer, path)
            spec.specifier, spec.typeName = Sdf.SpecifierDef, kind


def set_metadata(stage: Any, rate: float, codes: Sequence[float], *, up: str = "y") -> None:
    """Set the up axis, metres as the unit, the time codes per second, and the first and last of the codes."""
    _, geom, _ = package()
    geom.SetStageUpAxis(stage, geom.Tokens.z if up == "z" else geom.Tokens.y)
    geom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(codes[0])
    stage.SetEndTimeCode(codes[-1])


def usual_rate(times: Floats) -> float | None:
    """Return the first common rate with all times (F,) s but the last on its frames from 0 on; None for none."""
    for rate in USUAL_FPS:
        frames = times[: max(len(times) - 1, 1)] * rate
        if np.abs(frames - np.rint(frames)).max() < FRAME_TOLERANCE:
            return float(rate)
    return None


def vectors(rows: AnyArray) -> Any:
    """Return rows (n, 3) as an array of USD."""
    _, _, vt = package()
    return vt.Vec3fArray.FromNumpy(np.ascontiguousarray(rows, np.float32))
