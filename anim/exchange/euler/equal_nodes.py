"""Nodes with equal curves: they are converted once, as in files of thousands of copies."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import TypeVar

from anim.exchange.euler.curve import HANDLES, Curve
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode
from anim.model import Track

Item = TypeVar("Item")


def first_equal_nodes(nodes: Sequence[EulerNode]) -> list[int]:
    """Return for each node the index of the first one with equal rest pose, curves, convention and pivots.

    Names and parents may differ.
    first_equal_nodes([left, right, left_copy]) → [0, 1, 0]
    """
    return _first(nodes, _motion_content)


def first_equal_rotations(motion: EulerMotion, tracks: Sequence[Track]) -> list[int]:
    """Return for each rotation track the index of the first one with equal keys, convention and pivots.

    tracks: of nodes of the motion.
    """

    def content(track: Track) -> tuple[object, ...]:
        node = motion.nodes[track.node or 0]
        digest = hashlib.blake2b(digest_size=16)
        for values in (track.values, track.in_tangents, track.out_tangents):
            if values is not None:
                digest.update(values.tobytes())
        return track.time_axis, track.interpolation, node.order, node.frame, *_pivots(node), digest.digest()

    return _first(tracks, content)


def _first(items: Sequence[Item], content: Callable[[Item], object]) -> list[int]:
    first: dict[object, int] = {}
    return [first.setdefault(content(item), i) for i, item in enumerate(items)]


def _motion_content(node: EulerNode) -> tuple[object, ...]:
    rest = node.translation.tobytes(), node.angles.tobytes(), node.scale.tobytes()
    curves = (
        *node.rotation,
        *(node.moves.get(axis) for axis in range(3)),
        *(node.scales.get(axis) for axis in range(3)),
    )
    digests = (None if curve is None else _digest(curve) for curve in curves)
    return node.order, node.frame, *_pivots(node), *rest, *digests


def _pivots(node: EulerNode) -> tuple[bytes, ...]:
    if node.pivots is NO_PIVOTS:
        return ()
    return tuple([getattr(node.pivots, each.name).tobytes() for each in fields(node.pivots)])


def _digest(curve: Curve) -> bytes:
    digest = hashlib.blake2b(str(len(curve.values)).encode(), digest_size=16)
    for name in ("times", "values", "modes", *HANDLES):
        part = getattr(curve, name)
        digest.update(b"-" if part is None else part.tobytes())
    return digest.digest()
