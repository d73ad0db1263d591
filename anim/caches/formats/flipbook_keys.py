"""Nodes and channels of the pages of a flip-book, as JSON."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray
from anim.gltf.document import Json

POINTER, VISIBILITY = "KHR_animation_pointer", "KHR_node_visibility"


def page(mesh: int, frame: int, *, by_scale: bool) -> Json:
    """Return a node with the mesh of a frame, visible only for the first frame."""
    if not by_scale:
        return {"mesh": mesh, "extensions": {VISIBILITY: {"visible": frame == 0}}}
    return {"mesh": mesh, "scale": [0.0, 0.0, 0.0]} if frame else {"mesh": mesh}


def target(node: int, *, by_scale: bool) -> Json:
    """Return the target of the channel that switches a page."""
    if by_scale:
        return {"node": node, "path": "scale"}
    return visibility_target(node)


def visibility_target(node: int) -> Json:
    """Return the target of a channel that hides and shows a node."""
    pointer = f"/nodes/{node}/extensions/{VISIBILITY}/visible"
    return {"path": "pointer", "extensions": {POINTER: {"pointer": pointer}}}


def keys(times: AnyArray, frame: int) -> AnyArray:
    """Return key times of a page: hidden before its time and from the next page's on; the last one remains."""
    if frame == 0:
        return times[:2]
    return np.concatenate((times[:1], times[frame : frame + 2]))


def visible(frame: int, frames: int, *, by_scale: bool) -> AnyArray:
    """Return the values (K, C) at the keys of a page: scale or visibility."""
    values = (1, 0) if frame == 0 else (0, 1) if frame == frames - 1 else (0, 1, 0)
    column = np.array(values, "<f4" if by_scale else "u1")[:, None]
    return np.repeat(column, 3, axis=1) if by_scale else column


def extensions(frames: int, *, by_scale: bool) -> tuple[str, ...]:
    """Return the extensions that a flip-book uses."""
    return () if by_scale else (POINTER, VISIBILITY) if frames > 1 else (VISIBILITY,)
