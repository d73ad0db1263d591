"""GA006: clip names that break a pattern, or that Godot takes for a loop or not."""

from __future__ import annotations

import re
from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule, TextParameter

GODOT_LOOP = r"(?i)^(loop|cycle)|(loop|cycle)$"  # gltf_document.cpp of Godot 4

CYCLE = r"(?i)(^|[^a-z])(idle|walk|run|jog|sprint|crawl|swim|fly)(ing)?([^a-z]|$)"


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips. Without a pattern, and for other players than Godot, there are none."""
    pattern = parameters.texts["pattern"]
    for report in file.facts.clips:
        clip = file.contents.clips[report.index]
        if pattern and not re.search(pattern, clip.name):
            yield file.in_clip(report.index, problem=f"its name does not match {pattern}")
        if parameters.target == "godot" and clip.end > clip.start:
            is_named, is_closed = bool(re.search(GODOT_LOOP, clip.name)), _closes(file, report.seam_m, parameters)
            if is_named and not is_closed:
                yield file.in_clip(report.index, problem="Godot loops it by its name, and it jumps at the end")
            if is_closed and not is_named and re.search(CYCLE, clip.name):
                yield file.in_clip(report.index, problem="it ends as it starts, and Godot does not loop it by its name")


def _closes(file: CheckedFile, gap: float, parameters: Parameters) -> bool:
    return gap <= parameters["gap"] * file.diagonal


RULE = Rule(
    "GA006",
    "clip-name-pattern",
    Severity.INFO,
    "The name of a clip breaks a pattern; for Godot: it says loop or not, and the motion differs.",
    "Names are how programs find clips. Godot loops clips whose name begins or ends with loop or cycle, and plays the "
    "others once.",
    find,
    advice="rename the clip where the file is made",
    parameters={"gap": Parameter(0.001, "%", "largest jump of a clip that loops, of the model's size")},
    texts={"pattern": TextParameter("", "^[a-z]+(_[a-z]+)*$", "regular expression that names have to match")},
    is_default=False,
    targets={"godot": Severity.INFO},
)
