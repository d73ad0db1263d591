"""Unique labels of nodes and tracks, for formats with unique names and for messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from anim.model import Skeleton, Track
from anim.units import FEW, list_some


def unique(names: Sequence[str]) -> list[str]:
    """Return the names, repeated ones with a number that makes them unique: "Hand", "Hand.2".

    unique(["a", "a", "a.2"]) → "a", "a.3", "a.2"
    """
    given, seen, count = set(names), set[str](), Counter[str]()
    found = []
    for name in names:
        new = name
        while new in seen or (new != name and new in given):
            count[name] += 1
            new = f"{name}.{count[name] + 1}"
        seen.add(new)
        found.append(new)
    return found


def labels(skeleton: Skeleton) -> list[str]:
    """Return a unique one-line name for every node: "hip", "hip.2", "node 7" for an unnamed one."""
    return unique([" ".join(name.split()) or f"node {number}" for number, name in enumerate(skeleton.names)])


def label_of(track: Track, names: Sequence[str]) -> str:
    """Return a track's label: "weights of 'head'"."""
    return f"{track.path} of '{names[track.node]}'" if track.node is not None else f"{track.pointer}"


def skipped_note(what: Sequence[str]) -> tuple[str, ...]:
    """Return one note: "left out: weights of 'head', scale of 'arm' and 3 more"; none if empty."""
    return (f"left out: {list_some(what, FEW)}",) if what else ()
