"""Names of joints taken apart: namespace, prefix, side and the rest, so that two files' names can be compared."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}
SHARED = 0.6  # share of names that must begin alike for that to be a prefix


class Name(NamedTuple):
    """A name without what differs between tools: "mixamorig:LeftUpLeg" → ("left", "upleg")."""

    side: str
    stem: str


def plain(names: Sequence[str]) -> list[Name]:
    """Return the names of one skeleton taken apart, without namespaces and without a prefix that most of them share.

    plain(["Bip01 L Thigh", "Bip01 Head"]) → ("left", "thigh"), ("", "head")
    """
    bare = [re.split(r"[:|]", name)[-1] for name in names]
    prefix = _prefix(bare)
    return [_taken_apart(name[len(prefix) :] if prefix and _begins(name) == prefix else name) for name in bare]


def _prefix(names: Sequence[str]) -> str:
    starts = Counter(start for name in names if (start := _begins(name)))
    start, count = starts.most_common(1)[0] if starts else ("", 0)
    word = start.strip(" _.-").casefold()
    return start if count > 1 and count >= SHARED * len(names) and word not in SIDES else ""


def _begins(name: str) -> str:
    """The first word of a name with the separator, where a word follows: "Bip01 " of "Bip01 Head", "" of "tail.1"."""
    match = re.match(r"([^\s_.-]+[\s_.-]+).*[^\W\d_]{2}", name)
    return match[1] if match else ""


def _taken_apart(name: str) -> Name:
    words = [word.casefold() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_A-Za-z]+", name)]
    side = next((SIDES[word] for word in words if word in SIDES), "")
    stem = [str(int(word)) if word.isdecimal() else word for word in words if word not in SIDES]
    return Name(side, "".join(stem))
