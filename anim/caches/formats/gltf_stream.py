"""Author a GLB with pygltflib, its accessor data streamed into a temporary file."""

from __future__ import annotations

import shutil
import struct
import tempfile
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from anim.arrays import AnyArray, Floats, is_finite
from anim.caches.storage import COPY_BYTES, Outputs
from anim.errors import FormatError, UnsupportedError
from anim.gltf.authoring_parts import INDICES, VERTICES, add_accessor, create_document, create_material
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.io.container import BIN_CHUNK, JSON_CHUNK, MAGIC, MAX_GLB_BYTES

if TYPE_CHECKING:
    from pygltflib import GLTF2


class GlbFile:
    """A GLB under construction.

    gltf: pygltflib's object, to which nodes, meshes and clips are added.
    """

    def __init__(self) -> None:
        self.gltf: GLTF2 = create_document()
        self.gltf.materials.append(create_material(double_sided=True))
        self.size = 0
        self._bin = tempfile.TemporaryFile()  # noqa: SIM115  closed by write()

    def add(
        self,
        rows: AnyArray,
        *,
        target: int | None = None,
        normalized: bool = False,
        bounds: bool = False,
        width: int | None = None,
    ) -> int:
        """Append rows (n, C), already of their stored type, and return the index of their accessor.

        width: bytes per vertex if greater than the row itself (rows of 3 shorts have a stride of 8).
        Raises FormatError for floats that are not finite, as of differences beyond float32.
        """
        rows = np.ascontiguousarray(rows)
        if rows.dtype.kind == "f" and not is_finite(rows):
            raise FormatError("a difference of positions is too large for float32 (expected less than 3.4e38 m)")
        stride = None
        row_bytes = rows.shape[1] * rows.dtype.itemsize
        if target == VERTICES and row_bytes % 4:
            stride = row_bytes + -row_bytes % 4
            wide = np.zeros((len(rows), stride // rows.dtype.itemsize), rows.dtype)
            wide[:, : rows.shape[1]] = rows
            data = wide.tobytes()
        else:
            data = rows.tobytes()
        offset = self.size
        self._bin.write(data + bytes(-len(data) % 4))
        self.size += len(data) + -len(data) % 4
        return add_accessor(
            self.gltf,
            rows,
            offset=offset,
            length=len(data),
            stride=stride,
            target=target,
            normalized=normalized or None,
            bounds=bounds,
        )

    def add_indices(self, faces: AnyArray, vertices: int) -> int | None:
        """Append triangles (T, 3) and return the index of their accessor, None for no triangles."""
        if not len(faces):
            return None
        return self.add(faces.reshape(-1, 1).astype("<u2" if vertices < 65535 else "<u4"), target=INDICES)

    def write(self, outputs: Outputs, name: str) -> None:
        """Write the GLB. Raises UnsupportedError above 4 GiB."""
        from pygltflib import Buffer

        self.gltf.buffers.append(Buffer(byteLength=self.size))
        text = self.gltf.to_json(separators=(",", ":"), indent=None).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + self.size
        if total > MAX_GLB_BYTES:
            raise UnsupportedError(f"a GLB can't hold {total} bytes (its limit is {MAX_GLB_BYTES})")
        with self._bin, outputs.create(name) as file:
            file.write(struct.pack("<4sII", MAGIC, 2, total) + struct.pack("<II", len(text), JSON_CHUNK) + text)
            file.write(struct.pack("<II", self.size, BIN_CHUNK))
            self._bin.seek(0)
            shutil.copyfileobj(self._bin, file, COPY_BYTES)


def write_document(document: Document, outputs: Outputs, name: str = "") -> None:
    """Write a document as a GLB to the file `name`, by default the main one."""
    with outputs.create(name or outputs.main) as file:
        for piece in container.glb(document):
            file.write(piece.data)


def signed(tangents: AnyArray, handedness: Floats) -> AnyArray:
    """Return TANGENT (V, 4) of unit tangents (V, 3) and signs; zero tangents get a valid direction."""
    has = np.linalg.norm(tangents, axis=1, keepdims=True) > 0.5
    return np.concatenate((np.where(has, tangents, (1, 0, 0)), handedness[:, None]), axis=1).astype("<f4")


def primitive(attributes: dict[str, int], indices: int | None, targets: Sequence[dict[str, int]] = ()) -> Any:
    """Return a primitive with the file's only material: triangles, or points without indices."""
    from pygltflib import Attributes, Primitive

    found = Primitive(attributes=Attributes(**attributes), indices=indices, material=0, mode=None)
    if indices is None:
        found.mode = 0
    if targets:
        found.targets = list(targets)
    return found
