"""Annotations of VRM for first-person views, which name nodes (1.0) or meshes (0.x) that a bake replaces."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from anim.gltf.document import Json, json_array
from anim.gltf.writing.unknown_extensions import whole_number

_FIRST_PERSON, _ANNOTATIONS = "firstPerson", "meshAnnotations"


def move_annotations(
    json: Json, source: Json, new_nodes: Mapping[int, Sequence[int]], detached: Collection[int]
) -> None:
    """Let annotations name the nodes and meshes in place of baked ones, in place; the extensions are replaced whole.

    json: edited. new_nodes: by the node of a baked mesh, those that have it now. detached: nodes that had a mesh;
    annotations of those without one are removed.
    """

    def of_node(node: int) -> list[int]:
        return list(new_nodes.get(node, ())) if node in detached else [node]

    users: defaultdict[int, list[int]] = defaultdict(list)
    for i, node in enumerate(json_array(source, "nodes")):
        users[node.get("mesh", -1)].append(i)

    def of_mesh(mesh: int) -> list[int]:
        found = [
            json["nodes"][new]["mesh"] for user in users[mesh] for new in of_node(user) if "mesh" in json["nodes"][new]
        ]
        return sorted(set(found)) or [mesh]

    extensions = json.get("extensions")
    if not isinstance(extensions, dict):
        return
    for name, key, changed in (("VRMC_vrm", "node", of_node), ("VRM", "mesh", of_mesh)):
        old = _annotations(extensions.get(name))
        new = [each for annotation in old for each in _moved(annotation, key, changed)]
        if new != old:
            first_person = {**extensions[name][_FIRST_PERSON], _ANNOTATIONS: new}
            extensions = json["extensions"] = {**extensions, name: {**extensions[name], _FIRST_PERSON: first_person}}


def _annotations(extension: object) -> list[Any]:
    first_person = extension.get(_FIRST_PERSON) if isinstance(extension, dict) else None
    annotations = first_person.get(_ANNOTATIONS) if isinstance(first_person, dict) else None
    return annotations if isinstance(annotations, list) else []


def _moved(annotation: Any, key: str, changed: Callable[[int], list[int]]) -> list[Any]:
    """The annotation for each index in place of its own; itself if it has none."""
    index = whole_number(annotation.get(key)) if isinstance(annotation, dict) else None
    return [annotation] if index is None else [{**annotation, key: each} for each in changed(index)]
