"""GA002: clips with equal names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.arrays import group_indices
from anim.check.checked_file import CheckedFile
from anim.check.edits import free_name, rename_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document, json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence per name."""
    by_name = group_indices(each.get("name", "") for each in json_array(file.json, "animations"))
    for name, numbers in by_name.items():
        if name and len(numbers) > 1:
            problem = f"{len(numbers)} clips have this name (numbers {', '.join(map(str, numbers))})"
            advice = f"players find one of them by this name (here the last is '#{numbers[-1]}'); rename it"
            last = numbers[-1]
            label = f"clip '{name}'"
            yield Occurrence(
                label, f"/animations/{last}", len(numbers), problem=problem, advice=advice, number=last, name=name
            )


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a number behind all names but the first: "walk", "walk_2"."""
    names, seen = {}, set()
    taken = {clip.get("name", "") for clip in file.json["animations"]}
    for i, clip in enumerate(file.json["animations"]):
        name = clip.get("name", "")
        if name in seen:
            names[i] = free_name(name, taken)
        seen.add(name)
    return rename_clips(file.document, {i: name for i, name in names.items() if name})


RULE = Rule(
    "GA002",
    "duplicate-clip-names",
    Severity.WARNING,
    "Several clips have the same name.",
    "Players choose clips by name: the second one can't be chosen, or replaces the first.",
    find,
    fix=Fix("add a number to all names but the first", fix, is_safe=False),
)
