"""Storage options for new animation data: plain, or compressed by a meshopt extension."""

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

STRIDES = {"QUATERNION": 8}  # bytes per encoded element; the others have 4 per component


@dataclass(frozen=True, slots=True)
class FilteredValues:
    """Values in the form of a meshopt filter, before the codec.

    name: "QUATERNION" (8 bytes a key, int16 normalized when decoded) or "EXPONENTIAL" (4 bytes a number, float32 when
    decoded). codes: in key order; with tangents in glTF's order: in, value, out per key.
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
    """Storage of new accessors.

    extension: meshopt extension of compressed views; empty for plain views only.
    filtered: codes by id() of the track with the decoded values; other tracks are stored unfiltered.
    """

    extension: str = ""
    filtered: Mapping[int, FilteredValues] = field(default_factory=lambda: MappingProxyType({}))


UNCOMPRESSED = AccessorStorage()


def compress_document(extension: str, filtered: Mapping[int, FilteredValues]) -> AccessorStorage:
    """Return storage that compresses views by a meshopt extension where that is smaller.

    extension: "EXT_meshopt_compression" or "KHR_meshopt_compression".
    filtered: by id(track), for the tracks (those objects, which must stay alive) given to `replace_clips`.
    Raises RangeError for another extension.
    """
    if extension not in MESHOPT:
        raise RangeError(f"extension '{extension}' is not known (expected {' or '.join(MESHOPT)})")
    return AccessorStorage(extension, filtered)


def decompress_document(filtered: FilteredValues, columns: int) -> Floats:
    """Return the values (n, columns) decoded by meshopt's own decoder: the values that a track must have.

    Computing them in float64 instead differs by one step of int16 in up to 0.5 % of quaternions.
    """
    stored = decompressed_bytes(filtered)
    if filtered.name == "QUATERNION":
        integers = np.frombuffer(stored, "<i2")
        return denormalized(integers.astype(np.float64), integers.dtype).reshape(-1, 4)
    return np.frombuffer(stored, "<f4").astype(np.float64).reshape(-1, columns)


def decompressed_bytes(filtered: FilteredValues) -> bytes:
    """Return the decoded bytes of all codes."""
    stride = STRIDES.get(filtered.name, 4)
    rows = np.frombuffer(filtered.codes, np.uint8).reshape(-1, stride)
    about = {"count": len(rows), "byteStride": stride, "mode": "ATTRIBUTES", "filter": filtered.name}
    return codec.decode(np.frombuffer(codec.encode(rows, MESHOPT[0]), np.uint8), about).tobytes()
