"""GA401: files that are mostly animation."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the file."""
    size = file.facts.animation_stored_bytes + file.facts.animation_json_bytes
    total = file.contents.file_bytes
    if size > parameters["bytes"] and size > parameters["fraction"] * total:
        problem = f"animation takes {100 * size / total:.0f} % of the file"
        yield Occurrence("animations", "/animations", value=size / total, problem=problem)


RULE = Rule(
    "GA401",
    "large-animation",
    Severity.INFO,
    "Most bytes of the file are animation.",
    "Often every frame is sampled though few keys would do (KhronosGroup/glTF-Blender-IO#1322).",
    find,
    advice="leave out clips that nobody plays where the file is made; `optimize` writes the others in fewer bytes",
    parameters={
        "fraction": Parameter(0.5, "%", "fraction of the file's bytes"),
        "bytes": Parameter(100_000, "", "bytes of animation, below which the fraction does not matter"),
    },
)
