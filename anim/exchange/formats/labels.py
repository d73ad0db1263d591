"""What nodes and tracks are called where each name may stand once only, and for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from anim.model import Skeleton, Track

LISTED = 3  # of what is left out


def unique(names: Sequence[str]) -> list[str]:
    """Return the names, those that came before with a number that makes a name of its own: "Hand", "Hand.2".

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
    """Return a name on one line for every node, no two alike: "hip", "hip.2", "node 7" where it has none."""
    return unique([" ".join(name.split()) or f"node {number}" for number, name in enumerate(skeleton.names)])


def label_of(track: Track, names: Sequence[str]) -> str:
    """Return what a track moves, in words: "weights of 'head'"."""
    return f"{track.path} of '{names[track.node]}'" if track.node is not None else f"{track.pointer}"


def skipped_note(what: Sequence[str]) -> tuple[str, ...]:
    """Return one note: "left out: weights of 'head', scale of 'arm' and 3 more"; none where nothing is."""
    more = f" and {len(what) - LISTED} more" if len(what) > LISTED else ""
    return (f"left out: {', '.join(what[:LISTED])}{more}",) if what else ()
