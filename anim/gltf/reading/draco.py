"""KHR_draco_mesh_compression: vertices and faces of a primitive, decoded by Google's Draco (the package DracoPy).

Only what is looked at is decoded: documents are written with their Draco bytes as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Ints
from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Bytes, Json
from anim.gltf.reading.accessors import DTYPES, Accessors
from anim.gltf.validation.buffer_layout import COMPONENTS

EXTENSION = "KHR_draco_mesh_compression"


@dataclass(frozen=True, slots=True)
class DracoMesh:
    """What one piece of Draco data holds: arrays (V, C) by unique id, and faces (T, 3)."""

    attributes: Mapping[int, NDArray[Any]]
    faces: Ints


def read_primitive(primitive: Json, accessors: Accessors, *, views: int) -> tuple[Accessors, Ints]:
    """Return accessors that hold the decoded attributes of a primitive with the extension, and its faces (T, 3).

    views: how many buffer views the file has. Attributes that the extension does not name stay as they are.
    Raises FormatError where the data is not as the file says, UnsupportedError without DracoPy.
    """
    extension = primitive["extensions"][EXTENSION]
    view, names = _parsed(extension, views)
    mesh = decode(accessors.view(view))
    named = {name: number for name, number in names.items() if name in primitive["attributes"]}
    given = {
        primitive["attributes"][name]: _as_accessor(mesh, number, name, accessors.about(primitive["attributes"][name]))
        for name, number in named.items()
    }
    return accessors.over(given), mesh.faces


def decode(data: Bytes) -> DracoMesh:
    """Return what Draco data holds. Raises FormatError where it is broken, UnsupportedError without DracoPy."""
    try:
        import DracoPy
    except ImportError:
        problem = f"vertices are compressed by {EXTENSION}, which needs the package DracoPy"
        raise UnsupportedError(problem, help="pip install 'gltf-anim[draco]'") from None
    try:
        found = DracoPy.decode(data.tobytes())
    except Exception as error:  # its own kinds, and whatever the compiled code throws
        raise FormatError(f"Draco data can't be decoded ({str(error).lower()})") from None
    faces = getattr(found, "faces", None)  # a cloud of points has none
    return DracoMesh(
        {int(each["unique_id"]): np.asarray(each["data"]) for each in found.attributes},
        np.empty((0, 3), np.int64) if faces is None else np.asarray(faces, np.int64).reshape(-1, 3),
    )


def _parsed(extension: object, views: int) -> tuple[int, dict[str, int]]:
    """The buffer view and the unique ids by attribute that the extension names."""
    about = extension if isinstance(extension, dict) else {}
    view, names = about.get("bufferView"), about.get("attributes")
    if type(view) is not int or not 0 <= view < views:
        raise FormatError(f"bufferView is {view!r} (the file has {views})", where=EXTENSION)
    if not isinstance(names, dict) or any(type(number) is not int for number in names.values()):
        raise FormatError("attributes don't name numbers", where=EXTENSION)
    return view, names


def _as_accessor(mesh: DracoMesh, number: int, name: str, about: Json) -> NDArray[Any]:
    """A decoded attribute as the numbers that its accessor describes."""
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
