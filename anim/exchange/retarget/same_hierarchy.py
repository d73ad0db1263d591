"""Detect motions with a character's own hierarchy: nodes then match by name."""

from __future__ import annotations

from collections.abc import Sequence

from anim.exchange.formats.labels import labels
from anim.model import Skeleton


def is_same_hierarchy(source: Skeleton, target: Skeleton, chosen: Sequence[int]) -> dict[int, int]:
    """Return the target node of each chosen source node, by name; empty for different hierarchies.

    They agree if every chosen node, and its parent, if any, has the label (see `labels`) of a target node and its
    parent: as in a file exported from this character. Nodes that are no joints, and those with repeated names, then
    have their partners too.
    """
    found: dict[int, int] = {}
    by_label = {label: node for node, label in enumerate(labels(target))}
    for node in chosen:
        other, parent = by_label.get(source.names[node], -1), int(source.parents[node])
        other_parent = -1 if other < 0 else int(target.parents[other])
        if other < 0 or (parent >= 0 and by_label.get(source.names[parent], -1) != other_parent):
            return {}
        found[node] = other
    return found
