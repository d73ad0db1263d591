"""Pictures → bytes of a file: PNG by ourselves, moving ones through Pillow (extra `plot`)."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterable
from typing import Any

import numpy as np

from anim.errors import UnsupportedError
from anim.show.filmstrip import Image

LEVEL = 9
WEBP_QUALITY = 88
MOVING = {".webp": "WEBP", ".gif": "GIF", ".apng": "PNG"}


def png(image: Image) -> bytes:
    """Return a PNG of 8 bits a channel. image: (H, W, 3). Each row takes the filter whose numbers are smallest."""
    height, width = image.shape[:2]
    rows = image.reshape(height, -1).astype(np.uint8)
    left = np.concatenate((np.zeros((height, 3), np.uint8), rows[:, :-3]), axis=1)
    above = np.concatenate((np.zeros((1, rows.shape[1]), np.uint8), rows[:-1]))
    tried = np.stack((rows, rows - left, rows - above))
    best = np.abs(tried.view(np.int8).astype(np.int16)).sum(axis=2).argmin(axis=0)
    lines = np.empty((height, 1 + rows.shape[1]), np.uint8)
    lines[:, 0], lines[:, 1:] = best, tried[best, np.arange(height)]
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = ((b"IHDR", head), (b"sRGB", b"\0"), (b"IDAT", zlib.compress(lines.tobytes(), LEVEL)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, body) for kind, body in parts)


def moving(images: Iterable[Image], ending: str, *, fps: float) -> bytes:
    """Return the bytes of an endless film. ending: one of MOVING. Raises UnsupportedError without Pillow."""
    try:
        from PIL import Image as Pillow
    except ImportError:
        raise UnsupportedError(f"{ending} needs the package Pillow", help="pip install 'gltf-anim[plot]'") from None
    first, *others = [Pillow.fromarray(image) for image in images]
    out = io.BytesIO()
    about: dict[str, Any] = {"save_all": True, "append_images": others, "duration": round(1000 / fps), "loop": 0}
    if ending == ".webp":
        about |= {"quality": WEBP_QUALITY, "method": 4}
    first.save(out, MOVING[ending], **about)
    return out.getvalue()


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
