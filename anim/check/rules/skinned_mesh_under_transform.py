"""GA207: nodes of skinned meshes with a transform."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.node_edits import move_mesh_to_root
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document, copy_json, json_array

TOLERANCE = 1e-6


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the nodes that have or inherit a transform."""
    world = file.rest_world
    for i, node in enumerate(json_array(file.json, "nodes")):
        if "mesh" in node and "skin" in node and np.abs(world[i] - np.eye(4)[:3]).max() > TOLERANCE:
            yield file.in_node(i)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with these meshes at root nodes without transform."""
    json = copy_json(file.json)
    moved = [move_mesh_to_root(json, each.number) for each in found]
    return replace(file.document, json=json) if any(moved) else file.document


RULE = Rule(
    "GA207",
    "skinned-mesh-under-transform",
    Severity.WARNING,
    "The node of a skinned mesh has or inherits a transform.",
    "glTF ignores it, as joints place the mesh. Players that apply it show the mesh in another place "
    "(google/model-viewer#572); the Khronos validator warns.",
    find,
    counted("skinned mesh has a transform that is ignored", "skinned meshes have a transform that is ignored"),
    "put the mesh's node at the root of the scene where the file is made",
    fix=Fix("move the mesh to a root node without transform", fix, is_safe=True),
)
