"""GA003: animated nodes with equal names, or without one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import free_name, rename_nodes
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document
from anim.units import FEW, list_some

UNITY = "unity"


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence per name, for its first node; for Unity per path of names, by which it binds tracks."""
    if parameters.target == UNITY:
        yield from _equal_paths(file)
        return
    by_name: dict[str, list[int]] = {}
    for node in animated_nodes(file):
        by_name.setdefault(file.skeleton.names[node], []).append(node)
    for name, nodes in by_name.items():
        if len(nodes) > 1:
            named = f"are named '{name}'" if name else "have no name"
            problem = f"{len(nodes)} animated nodes {named} ({list_some([*map(str, nodes)], FEW)})"
            yield file.in_node(nodes[0], len(nodes), problem=problem)


def _equal_paths(file: CheckedFile) -> Iterator[Occurrence]:
    animated = set(animated_nodes(file))
    for path, nodes in _nodes_by_path(file).items():
        if len(nodes) > 1 and not animated.isdisjoint(nodes):
            listed = list_some([*map(str, nodes)], FEW)
            problem = f"{len(nodes)} nodes have the path '{path}' ({listed}), by which Unity finds animated ones"
            yield file.in_node(nodes[0], len(nodes), problem=problem)


def _nodes_by_path(file: CheckedFile) -> dict[str, list[int]]:
    """Indices of nodes by the names from the root; a node without a name gets one of its own in Unity."""
    skeleton, paths = file.skeleton, [""] * len(file.skeleton)
    found: dict[str, list[int]] = {}
    for level in skeleton.levels():
        for node in level.tolist():
            parent = int(skeleton.parents[node])
            above = f"{paths[parent]}/" if parent >= 0 else ""
            paths[node] = above + (skeleton.names[node] or f"Node-{node}")
            found.setdefault(paths[node], []).append(node)
    return {path: sorted(nodes) for path, nodes in found.items()}


def animated_nodes(file: CheckedFile) -> list[int]:
    """Return the indices of the nodes with a track in any chosen clip, sorted."""
    return sorted({track.node for _, clip in file.clips for track in clip.tracks if track.node is not None})


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a number behind all names but the first, and names for nodes without one."""
    if parameters.target == UNITY:
        return rename_nodes(file.document, _other_paths(file))
    taken, seen, names = set(file.skeleton.names), set(), {}
    for node in animated_nodes(file):
        name = file.skeleton.names[node]
        if name in seen or not name:
            names[node] = free_name(name or f"node_{node}", taken)
        seen.add(name)
    return rename_nodes(file.document, names)


def _other_paths(file: CheckedFile) -> dict[int, str]:
    """Other names by node, so that no animated node has the path of another one."""
    taken, names = set(file.skeleton.names), dict[int, str]()
    animated, parents = set(animated_nodes(file)), file.skeleton.parents
    for first, *others in _nodes_by_path(file).values():
        for other in others if not animated.isdisjoint((first, *others)) else ():
            one, node = first, other
            while parents[one] != parents[node]:  # the nearest siblings with equal names
                one, node = int(parents[one]), int(parents[node])
            if node not in names:
                names[node] = free_name(file.skeleton.names[node], taken)
    return names


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
