"""GA004: animated nodes whose name has a character that three.js removes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import free_name, rename_nodes
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.check.rules.duplicate_node_names import animated_nodes
from anim.gltf.document import Document

RESERVED = frozenset("[].:/")  # three.js, PropertyBinding.sanitizeNodeName
UNDERSCORES = {ord(character): "_" for character in RESERVED}


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the nodes."""
    for node in animated_nodes(file):
        if RESERVED & set(file.skeleton.names[node]):
            yield file.in_node(node)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with "_" instead of these characters."""
    taken = set(file.skeleton.names)
    names = {each.number: free_name(each.name.translate(UNDERSCORES), taken) for each in found}
    return rename_nodes(file.document, names)


RULE = Rule(
    "GA004",
    "reserved-characters",
    Severity.INFO,
    "Names of animated nodes have one of the characters [ ] . : /",
    "three.js removes them from names, so that a search for the name in the file finds nothing.",
    find,
    counted("animated node has one of [ ] . : / in its name", "animated nodes have one of [ ] . : / in their names"),
    "look for the name without these characters in three.js, or rename them where the file is made",
    fix=Fix("write _ instead", fix, is_safe=False),
)
