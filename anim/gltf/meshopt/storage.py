"""How new animation data is stored: plain, or compressed under one of meshopt's extensions. What a caller chooses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError, ShapeError
from anim.gltf.meshopt import codec
from anim.gltf.reading.accessors import denormalized
from anim.gltf.validation.buffer_layout import MESHOPT

STRIDES = {"QUATERNION": 8}  # bytes of an element's codes; the others have 4 per component


@dataclass(frozen=True, slots=True)
class FilteredValues:
    """Values as one of meshopt's filters takes them, before the codec.

    name: "QUATERNION" (8 bytes a key, int16 normalized when decoded) or "EXPONENTIAL" (4 bytes a number, float32 when
    decoded). codes: key after key; with tangents as glTF orders them: in, value, out per key.
    """

    name: str
    codes: bytes

    def __post_init__(self) -> None:
        if self.name not in ("QUATERNION", "EXPONENTIAL"):
            raise RangeError(f"filter '{self.name}' is not for animations (expected QUATERNION or EXPONENTIAL)")
        if not self.codes or len(self.codes) % STRIDES.get(self.name, 4):
            raise ShapeError(f"{len(self.codes)} bytes of codes are no whole number of elements ({self.name})")


@dataclass(frozen=True, slots=True)
class AccessorStorage:
    """How the numbers of new animations are stored.

    extension: meshopt's that compressed views use; empty for plain ones only.
    filtered: codes by id() of the track whose values they decode to; a track without any is stored as it is.
    """

    extension: str = ""
    filtered: Mapping[int, FilteredValues] = field(default_factory=lambda: MappingProxyType({}))


UNCOMPRESSED = AccessorStorage()


def compress_document(extension: str, filtered: Mapping[int, FilteredValues]) -> AccessorStorage:
    """Return a packing into views of "EXT_meshopt_compression" or "KHR_meshopt_compression", each where it pays.

    filtered: by id(track), for the tracks (those objects, which must stay alive) given to `replace_clips`.
    Raises RangeError for another extension.
    """
    if extension not in MESHOPT:
        raise RangeError(f"extension '{extension}' is not known (expected {' or '.join(MESHOPT)})")
    return AccessorStorage(extension, filtered)


def decompress_document(filtered: FilteredValues, columns: int) -> Floats:
    """Return the values (n, columns) that the codes decode to, by meshopt's own decoder: what a track has to hold.

    Computing them in float64 instead differs by one step of int16 in up to 0.5 % of quaternions.
    """
    stored = decompressed_bytes(filtered)
    if filtered.name == "QUATERNION":
        integers = np.frombuffer(stored, "<i2")
        return denormalized(integers.astype(np.float64), integers.dtype).reshape(-1, 4)
    return np.frombuffer(stored, "<f4").astype(np.float64).reshape(-1, columns)


def decompressed_bytes(filtered: FilteredValues) -> bytes:
    """Return the bytes that the codes decode to, as many as there are codes."""
    stride = STRIDES.get(filtered.name, 4)
    rows = np.frombuffer(filtered.codes, np.uint8).reshape(-1, stride)
    about = {"count": len(rows), "byteStride": stride, "mode": "ATTRIBUTES", "filter": filtered.name}
    return codec.decode(np.frombuffer(codec.encode(rows, MESHOPT[0]), np.uint8), about).tobytes()
