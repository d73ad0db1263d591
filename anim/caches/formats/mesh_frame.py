"""One frame ↔ the bytes of an OBJ, PLY or STL file, vertices in their order, written by trimesh.

A comment in the file (the header of an STL) stores properties without a field in these formats: "gltf-anim time=0.5
up=z".
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Ints
from anim.caches.formats import obj_reader
from anim.caches.formats.mesh_materials import MeshMaterials
from anim.caches.formats.mesh_text import number_fault
from anim.errors import FormatError

OBJ_DIGITS = 9  # decimals
REMARK = re.compile(rb"gltf-anim ((?:[a-z]+=\S+ ?)+)")
_TRIMESH = b"https://github.com/mikedh/trimesh"


@dataclass(frozen=True, slots=True)
class MeshFrame:
    """positions (V, 3) float32, faces (T, 3), normals (V, 3) float32 or None, values of the comment, materials."""

    positions: AnyArray
    faces: Ints
    normals: AnyArray | None
    remark: dict[str, str]
    materials: MeshMaterials | None = None


def write(still: MeshFrame, ending: str) -> bytes:
    """Return a file's bytes: ".ply" binary, ".obj" text, ".stl" binary, without a vertex order."""
    from trimesh import Trimesh
    from trimesh.exchange import obj, ply, stl

    normals = still.normals
    export_obj: Any = obj.export_obj
    mesh = Trimesh(still.positions, still.faces, vertex_normals=normals, process=False, validate=False)
    remark = " ".join(["gltf-anim", *(f"{key}={value}" for key, value in still.remark.items())]).encode()
    if ending == ".stl":
        data = stl.export_stl(mesh)
        return remark.ljust(80)[:80] + data[80:]
    if ending == ".obj":
        text = export_obj(mesh, include_normals=normals is not None, include_texture=False, digits=OBJ_DIGITS)
        if not len(still.faces):
            text = text.replace("\nf \n", "\n")  # one face without vertices
        if still.materials is not None:
            text = _with_materials(text, still.materials)
        return _with_comment(text.encode(), b"# ", remark)
    if still.materials is not None:
        mesh.vertex_attributes.update(zip("st", still.materials.coordinates.T, strict=True))
    return _with_comment(ply.export_ply(mesh, vertex_normal=normals is not None), b"comment ", remark)


def _with_materials(text: str, materials: MeshMaterials) -> str:
    """The text of an OBJ with texture coordinates, and its faces below the names of their materials."""
    lines = text.splitlines()
    corners = [line.split()[1:] for line in lines if line.startswith("f ")]
    new = [line for line in lines if not line.startswith("f ")]
    new += [f"mtllib {materials.library}"] if materials.library else []
    new += [f"vt {u:.9g} {v:.9g}" for u, v in materials.coordinates.tolist()]
    current = None
    for face, number in zip(corners, materials.of_face.tolist(), strict=True):
        if number != current and number >= 0:
            new.append(f"usemtl material{number}")
        current = number
        new.append("f " + " ".join(_corner(word) for word in face))
    return "\n".join(new) + "\n"


def _corner(word: str) -> str:
    """A corner with the texture coordinate of its vertex: "4//4" → "4/4/4", "4" → "4/4"."""
    vertex = word.split("/")[0]
    return f"{vertex}/{vertex}/{vertex}" if "/" in word else f"{vertex}/{vertex}"


def read(data: bytes, ending: str) -> MeshFrame:
    """Parse a file, polygons triangulated. Raises FormatError for an invalid one."""
    positions, faces, normals = obj_reader.read(data) if ending == ".obj" else _read_by_trimesh(data, ending)
    if not len(positions):
        raise FormatError("has no vertices")
    if not np.isfinite(positions).all():
        raise FormatError("holds NaN or infinity")
    outside = faces[(faces < 0) | (faces >= len(positions))]
    if outside.size:
        counted = f"a face uses vertex {outside[0]} of {len(positions)} (counted from 0)"
        raise FormatError(number_fault(data, ending) or counted)
    return MeshFrame(positions.astype(np.float32), faces, normals, comment_of(data))


def comment_of(head: bytes) -> dict[str, str]:
    """Return the values of this library's comment in the first bytes of a file; empty without one."""
    found = REMARK.search(head[:1024])
    words = found[1].decode("ascii", "replace").split() if found else []
    return dict(word.split("=", 1) for word in words if "=" in word)


def _with_comment(data: bytes, opening: bytes, remark: bytes) -> bytes:
    """The file with trimesh's comment replaced by this library's, or with it prepended."""
    if opening + _TRIMESH in data[:200]:
        return data.replace(opening + _TRIMESH, opening + remark, 1)
    first, _, others = data.partition(b"\n") if data.startswith(b"ply") else (b"", b"", data)
    return b"".join((first + b"\n" if first else b"", opening, remark, b"\n", others))


def _read_by_trimesh(data: bytes, ending: str) -> tuple[AnyArray, Ints, AnyArray | None]:
    from trimesh.exchange import ply
    from trimesh.geometry import triangulate_quads

    try:
        found: dict[str, Any]
        if ending == ".ply":  # fix_texture would merge vertices
            found = ply.load_ply(io.BytesIO(data), fix_texture=False, skip_materials=True)
        else:
            found = _read_stl(data)
        positions = np.asarray(found.get("vertices", np.empty((0, 3))), np.float64).reshape(-1, 3)
        faces = found.get("faces")
        triangles: Ints = (
            np.empty((0, 3), np.int64) if faces is None else np.asarray(triangulate_quads(faces), np.int64)
        )
        normals = found.get("vertex_normals")
        normals = None if normals is None else np.asarray(normals, np.float32)
    except Exception:  # trimesh raises exceptions of any type
        damaged = f"is no {ending} that can be read: damaged, or not as its beginning says"
        raise FormatError(number_fault(data, ending) or damaged) from None
    return positions, triangles.reshape(-1, 3), normals


def _read_stl(data: bytes) -> dict[str, Any]:
    from trimesh.exchange import stl

    try:
        return stl.load_stl_binary(io.BytesIO(data))
    except stl.HeaderError:  # text, or damaged; trimesh guesses its encoding by a package that may not be there
        return stl.load_stl_ascii(io.BytesIO(data.decode("latin-1").encode()))
