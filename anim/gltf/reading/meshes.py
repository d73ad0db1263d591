"""Primitives → Mesh: vertices, faces, influences and morph targets, in any encoding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import AnimError, FormatError
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.skin_weights import read_influences
from anim.gltf.validation.buffer_layout import DRACO
from anim.model import Mesh, PrimitiveRange

BYTES_PER_POSED_VERTEX = 600  # of each instance of a mesh, while it is measured or baked
BYTES_PER_MORPH = 8000  # of memory, for each target of each instance; work on 20 000 takes a second
POINTS, LINES, LINE_LOOP, LINE_STRIP, TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = range(7)


class Meshes:
    """Reader of one document's meshes, each once per skin size.

    Meshes and primitives of the same accessors share arrays, which are read-only.

    normals, tangents: read those too. repeats: store the vertices of equal primitives again for each.
    """

    def __init__(
        self,
        document: Document,
        accessors: Accessors,
        *,
        normals: bool = False,
        tangents: bool = False,
        repeats: bool = True,
    ) -> None:
        self._meshes = json_array(document.json, "meshes")
        self._views = len(json_array(document.json, "bufferViews"))
        self._accessors = accessors
        self._wanted = {"NORMAL": normals, "TANGENT": tangents}
        self._repeats = repeats
        self._done: dict[tuple[int, int], Mesh] = {}
        self._unnamed: dict[tuple[int, tuple[str, ...]], Mesh] = {}

    def mesh(self, number: int, *, joint_count: int) -> Mesh:
        """Return a mesh, its primitives concatenated. joint_count: of its skin, 0 without one.

        Raises FormatError for influences outside the skin, UnsupportedError for Draco without DracoPy.
        """
        key = (number, joint_count)
        if key not in self._done:
            about = self._meshes[number]
            name = about.get("name", "")
            try:
                self._done[key] = self._read(about, joint_count)
            except AnimError as error:
                raise error.at(f"mesh {number}{f' {name!r}' if name else ''}") from None
        return self._done[key]

    def _read(self, about: Json, joint_count: int) -> Mesh:
        primitives = about["primitives"]
        stored = tuple(map(_stored, primitives))
        if (joint_count, stored) not in self._unnamed:
            self._unnamed[joint_count, stored] = self._joined(primitives, stored, joint_count)
        mesh = self._unnamed[joint_count, stored]
        ranges = zip(mesh.primitives, primitives, strict=True)
        return replace(
            mesh,
            name=about.get("name", ""),
            rest_weights=np.array(about.get("weights") or [0.0] * len(mesh.targets), float),
            primitives=tuple(PrimitiveRange(each.vertices, each.faces, _material(of)) for each, of in ranges),
        )

    def _joined(self, primitives: Sequence[Json], stored: Sequence[str], joint_count: int) -> Mesh:
        """The primitives as one mesh without name and materials; equal ones are read once."""
        first: dict[str, int] = {}
        places = [first.setdefault(text, i) for i, text in enumerate(stored)]
        count = len(stored) if self._repeats else max(places, default=-1) + 1
        mesh = self._stored_once(primitives[:count], stored, joint_count)
        repeated = tuple(mesh.primitives[i] for i in places[count:])
        return replace(mesh, primitives=(*mesh.primitives, *repeated), repeats=tuple(places[count:]))

    def _stored_once(self, primitives: Sequence[Json], stored: Sequence[str], joint_count: int) -> Mesh:
        """The primitives one after another."""
        read: dict[str, Mesh] = {}
        parts = []
        for i, (primitive, text) in enumerate(zip(primitives, stored, strict=False)):
            if text not in read:
                try:
                    read[text] = self._primitive(primitive, joint_count)
                except AnimError as error:
                    raise error.at(f"primitive {i}") from None
            parts.append(read[text])
        if len(parts) == 1:
            return parts[0]
        self._accessors.budget.check(BYTES_PER_POSED_VERTEX * sum(len(part.positions) for part in parts))
        self._accessors.budget.add(sum(map(_num_bytes, parts)))
        return _join(parts, len(parts[0].targets) if parts else 0)

    def _primitive(self, primitive: Json, joint_count: int) -> Mesh:
        accessors, faces = self._accessors, None
        if DRACO in primitive.get("extensions", {}):
            from anim.gltf.reading import draco

            accessors, faces = draco.read_primitive(primitive, accessors, views=self._views)
        attributes = primitive["attributes"]
        if "POSITION" not in attributes:
            return _no_targets(len(primitive.get("targets", ())))
        positions = accessors.floats(attributes["POSITION"])
        if positions.shape[1] != 3:
            raise FormatError(f"POSITION has {positions.shape[1]} components (expected 3)")
        held = read_influences(accessors, attributes, len(positions), joint_count)
        about = primitive.get("targets", ())
        targets = self._displacements(about, "POSITION", len(positions))
        faces = self._faces(primitive, len(positions)) if faces is None else faces
        part = PrimitiveRange(len(positions), len(faces))
        return Mesh(
            "",
            positions,
            faces,
            held.joints,
            held.weights,
            targets,
            np.zeros(len(targets)),
            self._directions(accessors, attributes, "NORMAL", (len(positions), 3)),
            self._turns(about, "NORMAL", len(positions)),
            (part,),
            self._directions(accessors, attributes, "TANGENT", (len(positions), 4)),
            self._turns(about, "TANGENT", len(positions)),
            held.sums,
        )

    def _directions(self, accessors: Accessors, attributes: Json, name: str, shape: tuple[int, int]) -> Floats | None:
        if not self._wanted[name] or name not in attributes:
            return None
        found = accessors.floats(attributes[name])
        if found.shape != shape:
            raise FormatError(f"{name} has shape {found.shape} for {shape[0]} vertices (expected {shape})")
        return found

    def _turns(self, targets: Sequence[Json], name: str, vertices: int) -> Floats | None:
        if not self._wanted[name] or not any(name in target for target in targets):
            return None
        return self._displacements(targets, name, vertices)

    def _displacements(self, targets: Sequence[Json], attribute: str, vertices: int) -> Floats:
        """Morph displacements of an attribute (M, V, 3); empty if a target has none."""
        self._accessors.budget.add(8 * len(targets) * vertices * 3)
        result = np.zeros((len(targets), vertices, 3))
        for i, target in enumerate(targets):
            if attribute in target:
                moved = self._accessors.floats(target[attribute])
                if moved.shape != (vertices, 3):
                    noun = f"{attribute.lower()}s"
                    raise FormatError(f"a morph target has {len(moved)} {noun} for {vertices} vertices")
                result[i] = moved
        return result

    def _faces(self, primitive: Json, vertices: int) -> Ints:
        if "indices" in primitive:
            indices = self._accessors.indices(primitive["indices"])[:, 0]
        else:
            indices = np.arange(vertices)
        return _triangles(indices, primitive.get("mode", TRIANGLES))


def _stored(primitive: Json) -> str:
    """JSON of all that a primitive's vertices and faces are read from."""
    draco = primitive.get("extensions", {}).get(DRACO)
    return repr([*map(primitive.get, ("attributes", "indices", "mode", "targets")), draco])


def _num_bytes(mesh: Mesh) -> int:
    vertices = mesh.positions, mesh.faces, mesh.joints, mesh.weights, mesh.normals, mesh.tangents
    targets = mesh.targets, mesh.normal_targets, mesh.tangent_targets
    return sum(each.nbytes for each in (*vertices, *targets) if each is not None)


def _material(primitive: Json) -> int:
    material = primitive.get("material")
    return material if type(material) is int else -1


def _join(parts: list[Mesh], targets: int) -> Mesh:
    """Primitives one after another. targets: number of morph targets."""
    offsets = np.cumsum([0, *(len(part.positions) for part in parts)])
    influences = max((part.joints.shape[1] for part in parts), default=0)
    faces = [part.faces + offset for part, offset in zip(parts, offsets, strict=False)]
    return Mesh(
        "",
        np.concatenate([np.empty((0, 3)), *(part.positions for part in parts)]),
        np.concatenate([np.empty((0, 3), np.int64), *faces]),
        _stack([part.joints for part in parts], influences, np.int64),
        _stack([part.weights for part in parts], influences, np.float64),
        np.concatenate([np.empty((targets, 0, 3)), *(part.targets for part in parts)], axis=1),
        np.zeros(targets),
        _of_all([part.normals for part in parts]),
        _targets_of_all([(part.normal_targets, part.targets) for part in parts]),
        tuple(primitive for part in parts for primitive in part.primitives),
        _of_all([part.tangents for part in parts]),
        _targets_of_all([(part.tangent_targets, part.targets) for part in parts]),
        _sums_of_all(parts),
    )


def _triangles(indices: Ints, mode: int) -> Ints:
    """Faces (T, 3) of triangles, a fan or a strip (every second one reversed); none of points, lines."""
    if mode == TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    if mode in (TRIANGLE_STRIP, TRIANGLE_FAN) and len(indices) >= 3:
        i = np.arange(len(indices) - 2)
        if mode == TRIANGLE_FAN:
            return np.stack([indices[i + 1], indices[i + 2], np.broadcast_to(indices[0], i.shape)], axis=1)
        odd = i % 2
        return np.stack([indices[i], indices[i + 1 + odd], indices[i + 2 - odd]], axis=1)
    return np.empty((0, 3), np.int64)


def _stack(parts: list[np.ndarray], influences: int, dtype: type) -> np.ndarray:
    """Parts (V, I) concatenated, padded with zeros to the same influence count."""
    filled = [
        part if part.shape[1] == influences else np.pad(part, ((0, 0), (0, influences - part.shape[1])))
        for part in parts
    ]
    return np.concatenate([np.empty((0, influences), dtype), *filled])


def _of_all(parts: list[Floats | None]) -> Floats | None:
    """Normals or tangents of all primitives; None if one has none: faces then give the normals."""
    found = [part for part in parts if part is not None]
    return np.concatenate(found) if found and len(found) == len(parts) else None


def _sums_of_all(parts: list[Mesh]) -> Floats | None:
    """Stored sums of skin weights of all primitives, None if all are 1."""
    if all(part.weight_sums is None for part in parts):
        return None
    sums = (np.ones(len(part.positions)) if part.weight_sums is None else part.weight_sums for part in parts)
    return np.concatenate(list(sums))


def _targets_of_all(parts: list[tuple[Floats | None, Floats]]) -> Floats | None:
    """Morph displacements of directions of all primitives, from (directions, positions); 0 if absent."""
    if all(turns is None for turns, _ in parts):
        return None
    return np.concatenate([np.zeros(moves.shape) if turns is None else turns for turns, moves in parts], axis=1)


def _no_targets(targets: int) -> Mesh:
    none = np.empty((0, 0))
    faces = np.empty((0, 3), np.int64)
    joints, positions = none.astype(np.int64), np.empty((0, 3))
    displacements, part = np.empty((targets, 0, 3)), PrimitiveRange(0, 0)
    return Mesh(
        "", positions, faces, joints, none, displacements, np.zeros(targets), positions, None, (part,), np.empty((0, 4))
    )
