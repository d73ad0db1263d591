"""GA018: animated nodes with a matrix."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import node_label


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence for all nodes."""
    nodes = file.document.expanded
    if nodes:
        problem = "has a matrix and is animated" + (f", as {len(nodes) - 1} more nodes" if len(nodes) > 1 else "")
        yield Occurrence(node_label(file.json, nodes[0]), f"/nodes/{nodes[0]}", len(nodes), problem=problem)


RULE = Rule(
    "GA018",
    "animated-matrix",
    Severity.ERROR,
    "An animated node has a matrix instead of translation, rotation and scale.",
    "glTF 2.0 forbids it; players ignore the matrix or the animation.",
    find,
    advice="to decompose the matrix: gltf-anim convert IN OUT",
)
