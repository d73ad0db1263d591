"""Shapes of KHR_implicit_shapes, KHR_collision_shapes and OMI_physics_shape, and meshes as shapes."""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Document, json_array
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.meshes import Meshes
from anim.maths import matrix
from anim.model import Skeleton
from anim.sampling import rest_pose
from anim.sampling.world import local_by_node
from anim.simulation.rigid_bodies.description import Shape
from anim.simulation.rigid_bodies.extension_values import read_item, read_number, read_numbers, read_object
from anim.simulation.rigid_bodies.shapes import count_bytes, join_meshes, mesh_shape

# Radius and height of capsules and cylinders that a file leaves out: KHR's, OMI's.
KHR_DEFAULTS = {"capsule": (0.25, 0.5), "cylinder": (0.25, 0.5)}
OMI_DEFAULTS = {"capsule": (0.5, 1.0), "cylinder": (0.5, 2.0)}
MESH_KINDS = {"convex": "hull", "trimesh": "mesh", "mesh": "mesh"}
NODE_BYTES = 1000  # of a node at or below a collider: its matrix, and arrays beside their numbers


class ShapeReader:
    """Reader of a document's shapes. shapes: the extension's array; defaults: of this extension."""

    def __init__(
        self, document: Document, skeleton: Skeleton, shapes: list[Any], defaults: dict[str, tuple[float, float]]
    ) -> None:
        self._document = document
        self._skeleton = skeleton
        accessors = Accessors(document)
        self._meshes, self._budget = Meshes(document, accessors), accessors.budget
        self._counted_bytes = 0
        self._shapes = shapes
        self._defaults = defaults
        self._local = local_by_node(skeleton, rest_pose(skeleton))[:, 0]
        self._of_meshes: dict[tuple[int, str, tuple[float, ...] | None], Shape] = {}
        self._of_nodes: dict[tuple[int, str], Shape] = {}

    def shape(self, index: Any) -> Shape:
        """Return a shape of the array by index. Raises FormatError, RangeError or UnsupportedError."""
        json = read_item(self._shapes, index, "shape")
        kind = json.get("type") if isinstance(json, dict) else None
        if not isinstance(kind, str):
            raise FormatError(f"shape {index} has no type")
        values = read_object(json, kind) or json  # the first draft has the values beside the type
        if kind == "sphere":
            return Shape("sphere", (read_number(values, "radius", 0.5),))
        if kind == "box":
            return Shape("box", read_numbers(values, "size", 3) or (1.0, 1.0, 1.0))
        if kind in ("capsule", "cylinder"):
            return self._round_shape(kind, values)
        if kind == "plane":
            return _plane(values)
        if kind in MESH_KINDS:
            return self.mesh(values.get("mesh"), MESH_KINDS[kind])
        raise UnsupportedError(f"shape {index} is a '{kind}' (known: sphere, box, capsule, cylinder, plane, meshes)")

    def mesh(self, index: Any, kind: str, weights: Any = None) -> Shape:
        """Return the "mesh" or "hull" of a mesh by index, the same object again. weights: of its morph targets."""
        read_item(json_array(self._document.json, "meshes"), index, "mesh")
        mesh = self._meshes.mesh(index, joint_count=0)
        own = read_numbers({"weights": weights}, "weights", len(mesh.rest_weights))
        key = index, kind, own
        if key not in self._of_meshes:
            self._of_meshes[key] = mesh_shape(mesh, kind, None if own is None else np.array(own))
        return self._of_meshes[key]

    def node_meshes(self, node: Any, kind: str) -> Shape:
        """Return the "mesh" or "hull" of the meshes of a node and its descendants, in the node's space.

        Raises UnsupportedError if the nodes of all such colliders together, which can be below each other, take more
        than the limit of memory.
        """
        read_item(json_array(self._document.json, "nodes"), node, "node")
        if (node, kind) not in self._of_nodes:
            found = self._collect(int(node))
            if not found:
                raise FormatError(f"node {node} has no mesh to collide with")
            joined = join_meshes(found)
            hull = Shape("hull", points=joined.points[np.unique(joined.faces)]) if kind == "hull" else joined
            self._of_nodes[node, kind] = hull
        return self._of_nodes[node, kind]

    def _collect(self, root: int) -> list[Shape]:
        """Shapes of the meshes on a node and below, depth first, in the node's space."""
        nodes, found = json_array(self._document.json, "nodes"), []
        waiting = [(root, np.eye(4)[:3])]
        while waiting:
            node, to_root = waiting.pop()
            self._count(NODE_BYTES)
            json = nodes[node]
            if "mesh" in json:
                if "skin" in json:
                    raise UnsupportedError(f"{self._skeleton.label(node)} is skinned: a collider's mesh must be rigid")
                shape = self.mesh(json["mesh"], "mesh", json.get("weights"))
                self._count(count_bytes(shape))
                found.append(Shape("mesh", points=matrix.apply(to_root, shape.points), faces=shape.faces))
            children = reversed(json.get("children", ()))
            waiting += [(child, matrix.multiply(to_root, self._local[child])) for child in children]
        return found

    def _count(self, size: int) -> None:
        self._counted_bytes += size
        self._budget.check(
            self._counted_bytes,
            "the meshes of all colliders' nodes and the nodes below them",
            help="let each collider name its mesh, without those of other colliders below it, or raise `memory_limit`",
        )

    def _round_shape(self, kind: str, values: dict[str, Any]) -> Shape:
        radius, height = self._defaults[kind]
        radius = read_number(values, "radius", radius)  # older drafts have one radius
        bottom, top = (read_number(values, key, radius) for key in ("radiusBottom", "radiusTop"))
        height = read_number(values, "height", height)
        if not height > 0:
            raise FormatError(f"a {kind} has height {height:g} (expected above 0)")
        return Shape(kind, (height, bottom, top))


def _plane(values: dict[str, Any]) -> Shape:
    """An infinite plane, or the two triangles of one with sizes."""
    x, z = read_number(values, "sizeX", 0.0), read_number(values, "sizeZ", 0.0)
    if not x or not z:
        return Shape("plane")
    corners = np.array([[-x, 0, -z], [-x, 0, z], [x, 0, z], [x, 0, -z]]) / 2
    return Shape("mesh", points=corners, faces=np.array([[0, 1, 2], [0, 2, 3]]))
