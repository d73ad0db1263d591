"""GA002: clips with equal names."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence per name."""
    by_name: dict[str, list[int]] = {}
    for i, animation in enumerate(json_array(file.json, "animations")):
        by_name.setdefault(animation.get("name", ""), []).append(i)
    for name, numbers in by_name.items():
        if name and len(numbers) > 1:
            problem = f"{len(numbers)} clips have this name (numbers {', '.join(map(str, numbers))})"
            advice = f"players find one of them by this name (here the last is '#{numbers[-1]}'); rename it"
            last = numbers[-1]
            label = f"clip '{name}'"
            yield Occurrence(
                label, f"/animations/{last}", len(numbers), problem=problem, advice=advice, number=last, name=name
            )


RULE = Rule(
    "GA002",
    "duplicate-clip-names",
    Severity.WARNING,
    "Several clips have the same name.",
    "Players choose clips by name: the second one can't be chosen, or replaces the first.",
    find,
)
