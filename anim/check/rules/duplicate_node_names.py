"""GA003: animated nodes with equal names, or without one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import free_name, rename_nodes
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document
from anim.gltf.reading import reader


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence per name, for its first node."""
    by_name: dict[str, list[int]] = {}
    for node in animated_nodes(file):
        by_name.setdefault(file.skeleton.names[node], []).append(node)
    for name, nodes in by_name.items():
        if len(nodes) > 1:
            named = f"are named '{name}'" if name else "have no name"
            listed = ", ".join(map(str, nodes[: reader.MAX_LISTED_CLIPS]))
            more = f" and {len(nodes) - reader.MAX_LISTED_CLIPS} more" if len(nodes) > reader.MAX_LISTED_CLIPS else ""
            problem = f"{len(nodes)} animated nodes {named} ({listed}{more})"
            yield file.in_node(nodes[0], len(nodes), problem=problem)


def animated_nodes(file: CheckedFile) -> list[int]:
    """Return the indices of the nodes with a track in any chosen clip, sorted."""
    return sorted({track.node for _, clip in file.clips() for track in clip.tracks if track.node is not None})


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a number behind all names but the first, and names for nodes without one."""
    taken, seen, names = set(file.skeleton.names), set(), {}
    for node in animated_nodes(file):
        name = file.skeleton.names[node]
        if name in seen or not name:
            names[node] = free_name(name or f"node_{node}", taken)
        seen.add(name)
    return rename_nodes(file.document, names)


RULE = Rule(
    "GA003",
    "duplicate-node-names",
    Severity.WARNING,
    "Animated nodes have the same name, or none.",
    "Players that bind tracks by name animate the wrong node: mrdoob/three.js#15087, "
    "donmccurdy/three-gltf-viewer#58, bdero/flutter_scene#122.",
    find,
    advice="rename them where the file is made",
    fix=Fix("add a number to all names but the first", fix, is_safe=False),
)
