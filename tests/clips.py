"""Tracks, clips and skeletons by hand, from plain lists."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from anim.arrays import Floats
from anim.model import FLOAT32, AccessorFormat, Clip, Interpolation, Skeleton, TimeAxis, Track

STEP, LINEAR, CUBICSPLINE = Interpolation.STEP, Interpolation.LINEAR, Interpolation.CUBICSPLINE


def track(
    path: str,
    times: TimeAxis | ArrayLike,
    values: ArrayLike,
    mode: Interpolation = LINEAR,
    *,
    node: int | None = 0,
    tangents: tuple[ArrayLike, ArrayLike] | None = None,
    storage: AccessorFormat = FLOAT32,
) -> Track:
    """Return a track on a node, or on what a pointer names where `path` starts with a slash. tangents: in, out."""
    keys: tuple[Any, Any] = (times, values)
    sides: tuple[Any, Any] = tangents or (None, None)
    if path.startswith("/"):
        return Track(None, "pointer", mode, *keys, *sides, pointer=path, storage=storage)
    return Track(node, path, mode, *keys, *sides, storage=storage)


def clip(*tracks: Track, name: str = "") -> Clip:
    """Return the tracks as a clip."""
    return Clip(name, tracks)


def skeleton(parents: Sequence[int], **rest: Any) -> Skeleton:
    """Return nodes "0", "1", … under these parents. rest: translation, rotation, scale; else none, none and 1."""
    n = len(parents)
    rotation = np.tile([0.0, 0, 0, 1], (n, 1))
    parts: dict[str, Any] = {"translation": np.zeros((n, 3)), "rotation": rotation, "scale": np.ones((n, 3))}
    parts |= {key: value if key == "morphed" else np.asarray(value, float) for key, value in rest.items()}
    return Skeleton(tuple(map(str, range(n))), np.array(parents, np.int64), **parts)


def about(axis: str, degrees: ArrayLike) -> Floats:
    """Return the turns about "x", "y" or "z" as quaternions (..., 4)."""
    half = np.radians(np.asarray(degrees, float))[..., None] / 2
    direction = np.eye(3)["xyz".index(axis)]
    return np.concatenate((np.sin(half) * direction, np.cos(half)), axis=-1)
