"""Pictures → bytes of a file: PNG by ourselves, moving ones through Pillow (extra `plot`)."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterable
from typing import Any

import numpy as np

from anim.errors import RangeError, UnsupportedError
from anim.show.filmstrip.filmstrip import Image

LEVEL = 9
BAND = 1 << 24  # bytes of a picture that are filtered at a time
WEBP_QUALITY = 88
MOVING = {".webp": "WEBP", ".gif": "GIF", ".apng": "PNG"}
TICK = {".gif": 10}  # ms in which times are kept, else 1
MOST_FPS = {".gif": 50}  # quicker ones are shown at a tenth of the speed by most programs, else 1000


def png(image: Image) -> bytes:
    """Return a PNG of 8 bits a channel. image: (H, W, 3). Each row takes the filter whose numbers are smallest."""
    height, width = image.shape[:2]
    rows = image.reshape(height, -1)
    packer = zlib.compressobj(LEVEL)
    step = max(BAND // max(rows.shape[1], 1), 1)
    body = [packer.compress(_filtered(rows, low, min(low + step, height))) for low in range(0, height, step)]
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = ((b"IHDR", head), (b"sRGB", b"\0"), (b"IDAT", b"".join((*body, packer.flush()))), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, content) for kind, content in parts)


def _filtered(rows: Image, low: int, high: int) -> bytes:
    """Rows low … high of (H, 3W) as PNG has them: each after the number of its filter."""
    own = rows[low:high]
    left, above = np.zeros_like(own), np.zeros_like(own)
    left[:, 3:] = own[:, :-3]
    above[max(1 - low, 0) :] = rows[max(low - 1, 0) : high - 1]
    tried = np.stack((own, own - left, own - above))
    best = np.abs(tried.view(np.int8).astype(np.int16)).sum(axis=2).argmin(axis=0)
    lines = np.empty((len(own), 1 + own.shape[1]), np.uint8)
    lines[:, 0], lines[:, 1:] = best, tried[best, np.arange(len(own))]
    return lines.tobytes()


def moving(images: Iterable[Image], ending: str, *, fps: float) -> bytes:
    """Return the bytes of an endless film. ending: one of MOVING.

    Raises RangeError for more frames per second than the format has, UnsupportedError without Pillow.
    """
    if fps > MOST_FPS.get(ending, 1000):
        raise RangeError(f"{fps:g} frames per second are too many for {ending} (limit {MOST_FPS.get(ending, 1000)})")
    try:
        from PIL import Image as Pillow
    except ImportError:
        raise UnsupportedError(f"{ending} needs the package Pillow", help="pip install 'gltf-anim[plot]'") from None
    first, *others = [Pillow.fromarray(image) for image in images]
    out = io.BytesIO()
    about: dict[str, Any] = {
        "save_all": True,
        "append_images": others,
        "duration": durations(1 + len(others), ending, fps=fps),
        "loop": 0,
    }
    if ending == ".webp":
        about |= {"quality": WEBP_QUALITY, "method": 4}
    first.save(out, MOVING[ending], **about)
    return out.getvalue()


def durations(frames: int, ending: str, *, fps: float) -> list[int]:
    """Return how long each frame is shown, in ms that the format can keep: together as long as they should."""
    tick = TICK.get(ending, 1)
    ends = np.rint(np.arange(frames + 1) * 1000 / fps / tick) * tick
    return [round(each) for each in np.diff(ends).tolist()]


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
