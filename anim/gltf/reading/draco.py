"""KHR_draco_mesh_compression: decode vertices and faces of a primitive with the package DracoPy.

Data is decoded only on use: documents are written with their original Draco bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Ints
from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Bytes, Json
from anim.gltf.reading.accessors import DTYPES, Accessors
from anim.gltf.validation.buffer_layout import COMPONENTS, DRACO


class DracoMesh(NamedTuple):
    """Decoded Draco data: arrays (V, C) by unique id, and faces (T, 3)."""

    attributes: Mapping[int, NDArray[Any]]
    faces: Ints


def read_primitive(primitive: Json, accessors: Accessors, *, views: int) -> tuple[Accessors, Ints]:
    """Return accessors with the decoded attributes of a primitive, and its faces (T, 3).

    views: count of the file's buffer views. Attributes that are not in the extension are unchanged.
    Raises FormatError if the data contradicts the file, UnsupportedError without DracoPy.
    """
    extension = primitive["extensions"][DRACO]
    view, names = _parse_extension(extension, views)
    mesh = decode(accessors.view(view))
    named = {name: number for name, number in names.items() if name in primitive["attributes"]}
    given = {
        primitive["attributes"][name]: _as_accessor(mesh, number, name, accessors.about(primitive["attributes"][name]))
        for name, number in named.items()
    }
    return accessors.over(given), mesh.faces


def decode(data: Bytes) -> DracoMesh:
    """Decode Draco data. Raises FormatError for invalid data, UnsupportedError without DracoPy."""
    try:
        import DracoPy
    except ImportError:
        problem = f"vertices are compressed by {DRACO}, which needs the package DracoPy"
        raise UnsupportedError(problem, help="pip install 'gltf-anim[draco]'") from None
    try:
        found = DracoPy.decode(data.tobytes())
    except Exception as error:  # DracoPy's own types, and anything from the compiled code
        raise FormatError(f"Draco data can't be decoded ({str(error).lower()})") from None
    faces = getattr(found, "faces", None)  # a point cloud has none
    return DracoMesh(
        {int(each["unique_id"]): np.asarray(each["data"]) for each in found.attributes},
        np.empty((0, 3), np.int64) if faces is None else np.asarray(faces, np.int64).reshape(-1, 3),
    )


def _parse_extension(extension: object, views: int) -> tuple[int, dict[str, int]]:
    """The extension's buffer view, and its unique ids by attribute."""
    about = extension if isinstance(extension, dict) else {}
    view, names = about.get("bufferView"), about.get("attributes")
    if type(view) is not int or not 0 <= view < views:
        raise FormatError(f"bufferView is {view!r} (the file has {views})", where=DRACO)
    if not isinstance(names, dict) or any(type(number) is not int for number in names.values()):
        raise FormatError("attributes don't name numbers", where=DRACO)
    return view, names


def _as_accessor(mesh: DracoMesh, number: int, name: str, about: Json) -> NDArray[Any]:
    """A decoded attribute in the form that its accessor describes."""
    found = mesh.attributes.get(number)
    if found is None:
        raise FormatError(f"Draco data has no attribute {number} ({name})")
    columns, rows = COMPONENTS.get(about["type"], (1, 0))
    if found.shape != (about["count"], columns * rows):
        raise FormatError(
            f"Draco data has {found.shape[0]} × {found.shape[-1]} numbers for {name} "
            f"(expected {about['count']} × {columns * rows})"
        )
    return found.astype(DTYPES[about["componentType"]])
