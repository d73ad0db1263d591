"""Convert the up axis of a cache."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from anim.arrays import AnyArray
from anim.errors import RangeError
from anim.model import FrameChunk, VertexCache

UPS = ("y", "z")


def to_up_axis(cache: VertexCache, up: str) -> VertexCache:
    """Return the cache with another up axis: "y" as in glTF, "z" as in Blender: (x, y, z) → (x, −z, y).

    Raises RangeError for another axis. The cache itself if it has this axis.
    """
    if up not in UPS:
        raise RangeError(f"`up` is '{up}' (expected y or z)")
    if up == cache.up:
        return cache
    turn = _y_to_z if up == "z" else _z_to_y

    def chunks() -> Iterator[FrameChunk]:
        for chunk in cache.chunks():
            yield chunk.changed(turn)

    return replace(cache, chunks=chunks, rest=None if cache.rest is None else turn(cache.rest), up=up)


def _y_to_z(points: AnyArray) -> AnyArray:
    return np.stack((points[..., 0], -points[..., 2], points[..., 1]), axis=-1)


def _z_to_y(points: AnyArray) -> AnyArray:
    return np.stack((points[..., 0], points[..., 2], -points[..., 1]), axis=-1)
