"""Largest distance between two versions of a clip, with its place and time."""

from __future__ import annotations

from typing import NamedTuple


class MotionError(NamedTuple):
    """The largest distance between two versions of a clip.

    max_error: m, upper bound at the sampled times. time: s. place: the mesh or node. joint: the joint with the largest
    contribution. times: number of samples.
    max_pointer_error: largest error of a track that moves no node, and of morph weights that move no vertex, as a
    fraction of its range. pointer: that track's, or "the weights of 'face'".
    vertex: its index in the mesh, −1 for a shell or if the error is too small to be searched.
    is_around_node: whether it is that of a shell beside vertices; then `place` is the node, which moves none.
    """

    max_error: float
    time: float
    place: str
    joint: str
    times: int
    max_pointer_error: float = 0.0
    pointer: str = ""
    vertex: int = -1
    is_around_node: bool = False
