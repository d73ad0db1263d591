"""Normalize joint names: namespace, prefix and side removed, for comparison between files."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}
TOOL_PREFIX = re.compile(r"^(?:DEF-|mixamorig\d*_?)(?=\w)")  # of Rigify's joints, and of Mixamo's without colon
MAX_ROUNDS = 3  # rounds of removing affixes at both ends
CENTER = "c"  # VRoid's joints in the middle: "J_Bip_C_Hips"
MIN_DISTINCT_FRACTION = 0.9  # fraction of names that must remain distinct
MIN_SHARED_FRACTION = 0.6  # fraction of names with a common affix for it to be removed


class JointName(NamedTuple):
    """A name without the differences between tools: "mixamorig:LeftUpLeg" → ("left", "upleg")."""

    side: str
    stem: str


def normalize_names(names: Sequence[str]) -> list[JointName]:
    """Return the normalized names of one skeleton, without namespaces and common affixes.

    An affix is a prefix ("Bip01 "), a suffix ("_Armature"), or a serial number ("_023").
    normalize_names(["Bip01 L Thigh", "Bip01 Head"]) → ("left", "thigh"), ("", "head")
    """
    bare = [TOOL_PREFIX.sub("", re.split(r"[:|]", name)[-1]) for name in names]
    for _ in range(MAX_ROUNDS):
        bare = _drop_prefix(_drop_suffix(_drop_serials(bare)))
    return [_split_side(name) for name in bare]


def _drop_prefix(names: list[str]) -> list[str]:
    prefix = _common_affix([_first_word(name) for name in names])
    return [name[len(prefix) :] if prefix and _first_word(name) == prefix else name for name in names]


def _drop_suffix(names: list[str]) -> list[str]:
    ending = _common_affix([_last_word(name) for name in names])
    shorter = [name.removesuffix(ending) for name in names]
    return shorter if _differ(shorter) else names


def _drop_serials(names: list[str]) -> list[str]:
    """Names without the serial numbers that an exporter gave to all of them."""
    numbers = [match[0] for name in names if (match := re.search(r"_\d+$", name))]
    shorter = [re.sub(r"_\d+$", "", name) for name in names]
    counted = (
        len(numbers) > 1 and len(numbers) >= MIN_SHARED_FRACTION * len(names) and len(set(numbers)) == len(numbers)
    )
    return shorter if counted and _differ(shorter) else names


def _differ(names: list[str]) -> bool:
    return len(set(names)) >= MIN_DISTINCT_FRACTION * len(names)


def _common_affix(parts: list[str]) -> str:
    """The affix of most names; "" if it is a side."""
    counts = Counter(part for part in parts if part)
    part, count = counts.most_common(1)[0] if counts else ("", 0)
    is_side = part.strip(" _.-").casefold() in SIDES
    return part if count > 1 and count >= MIN_SHARED_FRACTION * len(parts) and not is_side else ""


def _last_word(name: str) -> str:
    """The last word of a name with its separator, after another word: "_Armature" of "hips_Armature"."""
    match = re.search(r"(?<=\w)[\s_.-]+[^\W\d_]{2,}$", name)
    return match[0] if match else ""


def _first_word(name: str) -> str:
    """The first word of a name with its separator: "Bip01 " of "Bip01 Head", "" of "tail.1"."""
    match = re.match(r"([^\s_.-]+[\s_.-]+).*[^\W\d_]{2}", name)
    return match[1] if match else ""


def _plain_number(word: str) -> str:
    """A word; a number without zeros before it, of any length: "01" → "1"."""
    return word.lstrip("0") or "0" if word.isdecimal() and word.isascii() else word


def _split_side(name: str) -> JointName:
    words = [word.casefold() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_A-Za-z]+", name)]
    side = next((SIDES[word] for word in words if word in SIDES), "")
    stem = [_plain_number(word) for word in words if word not in SIDES]
    if len(stem) > 1 and stem[0] == CENTER and not side:
        stem = stem[1:]
    return JointName(side, "".join(stem))
