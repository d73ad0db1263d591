"""GA004: animated nodes whose name has a character that three.js removes."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted
from anim.check.rules.duplicate_node_names import animated_nodes

RESERVED = frozenset("[].:/")  # three.js, PropertyBinding.sanitizeNodeName


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the nodes."""
    for node in animated_nodes(file):
        if RESERVED & set(file.skeleton.names[node]):
            yield file.in_node(node)


RULE = Rule(
    "GA004",
    "reserved-characters",
    Severity.INFO,
    "Names of animated nodes have one of the characters [ ] . : /",
    "three.js removes them from names, so that a search for the name in the file finds nothing.",
    find,
    counted("animated node has one of [ ] . : / in its name", "animated nodes have one of [ ] . : / in their names"),
    "look for the name without these characters in three.js, or rename them where the file is made",
)
