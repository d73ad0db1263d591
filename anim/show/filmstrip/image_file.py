"""Encoding of pictures by Pillow: PNG, and animated WebP, GIF and APNG."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from anim.errors import RangeError
from anim.show.filmstrip.renderer import Image

COMPRESSION_LEVEL = 9
WEBP_QUALITY = 88
ANIMATED_FORMATS = {".webp": "WEBP", ".gif": "GIF", ".apng": "PNG"}
TIME_RESOLUTION_MS = {".gif": 10}  # ms, resolution of frame durations; 1 for other formats
MAX_FPS = {".gif": 50}  # most programs play faster files at a tenth of the speed; 1000 for other formats


def png(image: Image) -> bytes:
    """Return a PNG of 8 bits per channel, tagged as sRGB. image: (H, W, 3)."""
    from PIL import Image as Pillow
    from PIL.PngImagePlugin import PngInfo

    color_space = PngInfo()
    color_space.add(b"sRGB", b"\0")
    out = io.BytesIO()
    Pillow.fromarray(image).save(out, "PNG", compress_level=COMPRESSION_LEVEL, pnginfo=color_space)
    return out.getvalue()


def animation(images: Iterable[Image], ending: str, *, fps: float) -> bytes:
    """Return the bytes of a looped film. ending: one of MOVING.

    Raises RangeError for more frames per second than the format supports.
    """
    from PIL import Image as Pillow

    if fps > MAX_FPS.get(ending, 1000):
        raise RangeError(f"{fps:g} frames per second are too many for {ending} (limit {MAX_FPS.get(ending, 1000)})")
    first, *others = [Pillow.fromarray(image) for image in images]
    out = io.BytesIO()
    about: dict[str, Any] = {
        "save_all": True,
        "append_images": others,
        "duration": durations_ms(1 + len(others), ending, fps=fps),
        "loop": 0,
    }
    if ending == ".webp":
        about |= {"quality": WEBP_QUALITY, "method": 4}
    first.save(out, ANIMATED_FORMATS[ending], **about)
    return out.getvalue()


def durations_ms(frames: int, ending: str, *, fps: float) -> list[int]:
    """Return frame durations in ms, multiples of the format's resolution with the exact sum."""
    tick = TIME_RESOLUTION_MS.get(ending, 1)
    ends = np.rint(np.arange(frames + 1) * 1000 / fps / tick) * tick
    return [round(each) for each in np.diff(ends).tolist()]
