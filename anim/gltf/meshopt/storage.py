"""Values in the form of meshopt's filters."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError, ShapeError
from anim.gltf.meshopt import codec
from anim.gltf.reading.accessors import denormalized
from anim.gltf.validation.buffer_layout import MESHOPT
from anim.model import Track

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


@dataclass(frozen=True, slots=True, eq=False, init=False)
class EncodedTrack(Track):
    """Track with its values in the form of a meshopt filter too: see `attach_codes`."""

    codes: FilteredValues

    def __init__(self, *, codes: FilteredValues, **of_track: Any) -> None:
        Track.__init__(self, **of_track)  # super() finds no class with slots
        object.__setattr__(self, "codes", codes)


def attach_codes(track: Track, codes: FilteredValues) -> EncodedTrack:
    """Return the track with codes of its values, which the writer stores in place of them."""
    return EncodedTrack(**{each.name: getattr(track, each.name) for each in fields(Track) if each.init}, codes=codes)


def check_extension(extension: str) -> None:
    """Raise RangeError unless `extension` is one of meshopt's, or empty for none."""
    if extension and extension not in MESHOPT:
        raise RangeError(f"extension '{extension}' is not known (expected {' or '.join(MESHOPT)})")


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
