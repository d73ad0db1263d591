"""Track → accessor contents, in the track's own storage type where that is lossless."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats
from anim.errors import DataRangeError, ShapeError, UnsupportedError
from anim.gltf.document import Json
from anim.gltf.meshopt import storage
from anim.gltf.meshopt.storage import EncodedTrack, FilteredValues
from anim.gltf.reading.accessors import DTYPES, FLOAT, denormalized
from anim.gltf.validation.buffer_layout import COMPONENTS
from anim.model import AccessorFormat, Interpolation, TimeAxis, Track

MIN_INFINITE = 2.0**128 - 2.0**103  # the smallest number that float32 rounds to infinity
ELEMENTS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}
BY_WIDTH = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
DECODED = {
    "QUATERNION": AccessorFormat(5122, normalized=True),
    "EXPONENTIAL": AccessorFormat(),
}  # of a filter's decoded codes


@dataclass(frozen=True, slots=True)
class AccessorData:
    """The content of one accessor: stored bytes and their type. Equal contents can share an accessor.

    filtered: the same values in the form of a meshopt filter. key_size: bytes of a key, several elements for weights.
    """

    data: bytes
    component_type: int
    element: str
    normalized: bool = False
    bounds: tuple[float, float] | None = None
    filtered: FilteredValues | None = field(default=None, compare=False)
    key_size: int = field(default=4, compare=False)

    @property
    def element_size(self) -> int:
        """Bytes per element."""
        columns, rows = COMPONENTS[self.element]
        return np.dtype(DTYPES[self.component_type]).itemsize * columns * rows

    def accessor(self, view: int, offset: int) -> Json:
        """Return the JSON of an accessor at `offset` of `view`; defaults are omitted."""
        about: Json = {"bufferView": view}
        if offset:
            about["byteOffset"] = offset
        about["componentType"] = self.component_type
        if self.normalized:
            about["normalized"] = True
        about["count"] = len(self.data) // self.element_size
        about["type"] = self.element
        if self.bounds is not None:
            about["min"], about["max"] = [self.bounds[0]], [self.bounds[1]]
        return about


def times(axis: TimeAxis) -> AccessorData:
    """Return the key times as float32, with min and max exact in float32 and short as text.

    Raises UnsupportedError if two keys are equal in float32.
    """
    stored = axis.times.astype("<f4")
    if len(stored) > 1 and not (np.diff(stored) > 0).all():
        k = int(np.argmax(np.diff(stored) <= 0))
        raise UnsupportedError(
            f"keys {k} and {k + 1} fall together in float32 (both at {stored[k]} s)",
            help=f"float32 steps there are {np.spacing(stored[k]):.2g} s: start the clip at 0 s or use fewer keys",
        )
    return AccessorData(stored.tobytes(), FLOAT, "SCALAR", bounds=(_shortest(stored[0]), _shortest(stored[-1])))


def values(track: Track) -> AccessorData:
    """Return the values, with tangents for CUBICSPLINE in glTF's order: in, value, out per key.

    Integers of the track's storage type if they reproduce every value, else float32. Raises ShapeError if the codes of
    an `EncodedTrack` decode to different values.
    """
    rows = track.values
    if track.interpolation is Interpolation.CUBICSPLINE and track.in_tangents is not None:
        assert track.out_tangents is not None
        rows = np.stack((track.in_tangents, rows, track.out_tangents), axis=1)
    element = ELEMENTS.get(track.path) or track.storage.element or BY_WIDTH.get(rows.shape[-1], "SCALAR")
    filtered = track.codes if isinstance(track, EncodedTrack) else None
    storage = track.storage if filtered is None else DECODED[filtered.name]
    stored = _quantize(rows, storage)
    integers = stored.dtype.kind != "f"
    kind, normalized = (storage.component_type, storage.normalized) if integers else (FLOAT, False)
    key_size = stored.itemsize * rows.shape[-1]
    data = stored.tobytes() if filtered is None else _as_client_decodes(stored, element, filtered)
    return AccessorData(data, kind, element, normalized, filtered=filtered, key_size=key_size)


def _quantize(rows: Floats, storage: AccessorFormat) -> NDArray[Any]:
    if storage.component_type != FLOAT:
        integers = _integers(rows, np.dtype(DTYPES[storage.component_type]), storage.normalized)
        if integers is not None:
            return integers
    if np.count_nonzero(np.abs(rows) < MIN_INFINITE) < rows.size:
        raise DataRangeError(f"a value of {float(np.abs(rows).max()):.3g} is too large for float32")
    return rows.astype("<f4")


def _as_client_decodes(stored: NDArray[Any], element: str, filtered: FilteredValues) -> bytes:
    """The decoded bytes of the codes, equal to `stored` except for the sign of zeros."""
    decoded = storage.decompressed_bytes(filtered)
    same = stored.nbytes == len(decoded) and np.array_equal(np.frombuffer(decoded, stored.dtype), stored.ravel())
    if not same or (filtered.name == "QUATERNION") is not (element == "VEC4" and stored.dtype.kind == "i"):
        raise ShapeError(f"values are not what their {filtered.name} codes decode to")
    return decoded


def _integers(rows: Floats, dtype: np.dtype[Any], normalized: bool) -> NDArray[Any] | None:
    limits = np.iinfo(dtype)
    scaled = np.rint(rows * limits.max if normalized else rows)
    if scaled.min() < limits.min or scaled.max() > limits.max:
        return None
    stored = scaled.astype(dtype)
    back = stored.astype(np.float64)
    if normalized:
        back = denormalized(back, dtype)
    return stored if np.array_equal(back, rows) else None


def _shortest(value: np.float32) -> float:
    """The number of the shortest text for this float32: 1.0416666, not 1.0416666269302368; 2, not 2.0."""
    number = float(str(value))
    return int(number) if number.is_integer() else number
