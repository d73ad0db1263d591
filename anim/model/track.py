"""Track: an animated property with its key times, values, interpolation and storage format."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from anim import arrays
from anim.arrays import Floats
from anim.errors import RangeError, ShapeError
from anim.model.time_axis import TimeAxis, as_time_axis

PATHS = ("translation", "rotation", "scale", "weights")
NUM_COMPONENTS = {"translation": 3, "rotation": 4, "scale": 3}  # components per key; of weights and pointers they vary


class Interpolation(StrEnum):
    """Interpolation between keys, by glTF's names."""

    STEP = "STEP"
    LINEAR = "LINEAR"
    CUBICSPLINE = "CUBICSPLINE"


class ValueKind(StrEnum):
    """Type of values, which determines their interpolation."""

    VECTOR = "vector"  # component by component
    ROTATION = "rotation"  # unit quaternion (x, y, z, w)
    DISCRETE = "discrete"  # bool or integer: STEP only


class AccessorFormat(NamedTuple):
    """Storage format of values: glTF's component type, normalization of integers, and element type.

    element: "SCALAR", "VEC3", …; None if the path determines it.
    """

    component_type: int = 5126
    normalized: bool = False
    element: str | None = None


FLOAT32 = AccessorFormat()
BYTE_UNIT_TOLERANCE = 0.00769  # of the length of quaternions in normalized bytes, from the Khronos validator


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Track:
    """Keys of one property of a node, or of the target of a JSON pointer.

    path: "translation", "rotation", "scale" or "weights" of `node`; "pointer" if the target is no node property.
    time_axis: key times (K,) in seconds, ≥ 0, strictly increasing; an axis is shared, an array becomes a new one.
    values: (K, C) metres, unit quaternion (x, y, z, w), factor, weight, or the pointer's own unit.
    in_tangents, out_tangents: (K, C) per second, for CUBICSPLINE only.
    pointer: the target by KHR_animation_pointer; `node` and `path` agree with it if it names a node's property.
    storage: format of the values in the file; writers reuse it if it represents the new values exactly.
    Writable arrays are copied, read-only ones shared.
    Raises ShapeError, or RangeError for a target or an interpolation unknown to glTF, or invalid keys.
    Track(0, "translation", "LINEAR", [0, 1], [[0, 0, 0], [0, 1, 0]]): node 0 rises by a metre in a second
    """

    node: int | None
    path: str
    interpolation: Interpolation
    time_axis: TimeAxis
    values: Floats
    in_tangents: Floats | None
    out_tangents: Floats | None
    pointer: str | None
    storage: AccessorFormat
    _digest: bytes | None = field(init=False, repr=False)  # once asked for

    def __init__(
        self,
        node: int | None,
        path: str,
        interpolation: Interpolation | str,
        time_axis: TimeAxis | ArrayLike,
        values: ArrayLike,
        in_tangents: ArrayLike | None = None,
        out_tangents: ArrayLike | None = None,
        pointer: str | None = None,
        storage: AccessorFormat = FLOAT32,
    ) -> None:
        set_field = object.__setattr__
        set_field(self, "path", path)
        set_field(self, "pointer", pointer)
        set_field(self, "storage", storage)
        set_field(self, "_digest", None)
        if type(node) is not int or node < 0 or path not in PATHS:  # otherwise the target is valid
            node = _node(node, path)
        set_field(self, "node", node)
        if type(interpolation) is not Interpolation:
            interpolation = _interpolation(interpolation)
        set_field(self, "interpolation", interpolation)
        time_axis, values = as_time_axis(time_axis), arrays.as_floats(values, "K C", name="values")
        set_field(self, "time_axis", time_axis)
        set_field(self, "values", values)
        shape = (len(time_axis), NUM_COMPONENTS.get(path, int(values.shape[1])))
        if values.shape != shape:
            raise ShapeError(f"values have shape {values.shape} (expected {shape})")
        cubic = interpolation is Interpolation.CUBICSPLINE
        if (in_tangents is not None) is not cubic or (out_tangents is not None) is not cubic:
            raise ShapeError(f"{interpolation} with {'one or no' if cubic else 'in or out'} tangents")
        set_field(self, "in_tangents", _tangents(in_tangents, shape, "in tangents"))
        set_field(self, "out_tangents", _tangents(out_tangents, shape, "out tangents"))

    @classmethod
    def unchecked(
        cls,
        node: int | None,
        path: str,
        interpolation: Interpolation,
        time_axis: TimeAxis,
        values: Floats,
        in_tangents: Floats | None = None,
        out_tangents: Floats | None = None,
        pointer: str | None = None,
        storage: AccessorFormat = FLOAT32,
    ) -> Track:
        """Return the track of fields that are valid and read-only already: files have thousands of them."""
        track, set_field = object.__new__(cls), object.__setattr__
        set_field(track, "node", node)
        set_field(track, "path", path)
        set_field(track, "interpolation", interpolation)
        set_field(track, "time_axis", time_axis)
        set_field(track, "values", values)
        set_field(track, "in_tangents", in_tangents)
        set_field(track, "out_tangents", out_tangents)
        set_field(track, "pointer", pointer)
        set_field(track, "storage", storage)
        set_field(track, "_digest", None)
        return track

    def __reduce__(self) -> tuple[Any, ...]:
        return arrays.reduce_fields(self)

    @property
    def times(self) -> Floats:
        """Key times (K,) of `time_axis`, in seconds."""
        return self.time_axis.times

    def with_keys(
        self,
        times: TimeAxis | ArrayLike,
        values: ArrayLike,
        in_tangents: ArrayLike | None = None,
        out_tangents: ArrayLike | None = None,
        *,
        interpolation: Interpolation | None = None,
    ) -> Track:
        """Return the track with other keys, and with another interpolation if given."""
        name, storage = interpolation or self.interpolation, self.storage
        return Track(self.node, self.path, name, times, values, in_tangents, out_tangents, self.pointer, storage)

    def on_node(self, node: int) -> Track:
        """Return the same keys on another node, ≥ 0, for a track of a node's translation, rotation or scale.

        Nothing is checked again: files have the same keys on thousands of nodes.
        """
        return Track.unchecked(node, *_copied(self))

    def __eq__(self, other: object) -> bool:
        """Return whether the other track has the same keys, target and storage."""
        if not isinstance(other, Track):
            return NotImplemented
        if self is other:
            return True
        return self.storage == other.storage and self.has_same_keys(other)

    def has_same_keys(self, other: Track) -> bool:
        """Return whether the other track has the same keys and target; its storage may differ."""
        if self._target_and_interpolation != other._target_and_interpolation:
            return False
        return all(map(_same, self._numbers, other._numbers))

    def __hash__(self) -> int:
        return hash((self._words, self.values.shape))

    @property
    def digest(self) -> bytes:
        """Digest of target, keys and storage, for comparisons of many tracks with each other."""
        if self._digest is None:
            try:
                from _blake2 import blake2b  # part of hashlib, which loads OpenSSL
            except ImportError:  # of another Python than CPython
                from hashlib import blake2b

            header = repr((*self._words, self.values.shape))
            digest = blake2b(header.encode(errors="surrogatepass"), digest_size=16)
            for numbers in self._numbers:
                if numbers is not None:
                    digest.update(np.ascontiguousarray(numbers).data)
            object.__setattr__(self, "_digest", digest.digest())
        return self._digest or b""

    @property
    def _words(self) -> tuple[object, ...]:
        return *self._target_and_interpolation, self.storage

    @property
    def _target_and_interpolation(self) -> tuple[object, ...]:
        return self.node, self.path, self.interpolation, self.pointer

    @property
    def _numbers(self) -> tuple[Floats | None, ...]:
        return self.times, self.values, self.in_tangents, self.out_tangents

    @property
    def target(self) -> tuple[int | None, str]:
        """Comparable target of the track: (node, path), or (None, pointer)."""
        return (None, self.pointer or "") if self.path == "pointer" else (self.node, self.path)

    @property
    def kind(self) -> ValueKind:
        """Type of the values.

        A pointer that ends in "/rotation" and has four components is a quaternion; integers that are not normalized
        under STEP are bools or integers of the object model (KHR_animation_pointer allows nothing else for those).
        """
        if self.path == "rotation":
            return ValueKind.ROTATION
        if self.pointer is None:
            return ValueKind.VECTOR
        if self.pointer.endswith("/rotation") and self.values.shape[1] == 4:
            return ValueKind.ROTATION
        integers = self.storage.component_type != 5126 and not self.storage.normalized
        return ValueKind.DISCRETE if integers and self.interpolation is Interpolation.STEP else ValueKind.VECTOR

    def __repr__(self) -> str:
        target = f"node={self.node}, {self.path}" if self.pointer is None else repr(self.pointer)
        span = f"start_s={self.times[0]:.6g}, end_s={self.times[-1]:.6g}"
        return f"Track({target}, {self.interpolation}, keys={len(self.times)}, {span})"


_copied = operator.attrgetter(*(each.name for each in fields(Track) if each.init and each.name != "node"))


def _same(one: Floats | None, other: Floats | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)


def _node(node: int | None, path: str) -> int | None:
    """The node as a plain integer, which JSON can represent; None for a pointer's target."""
    if path not in PATHS and path != "pointer":
        raise RangeError(f"path is '{path}' (expected {', '.join(PATHS)} or pointer)")
    if (node is None) is not (path == "pointer"):
        raise RangeError(f"node is {node} with path '{path}' (expected a number, and None with path 'pointer' only)")
    if node is None:
        return None
    try:
        number = operator.index(node)
    except TypeError:
        raise ShapeError(f"node is {node!r} (expected its number in the file)") from None
    if number < 0:
        raise RangeError(f"node is {number} (expected its number in the file, 0 or more)")
    return number


def _interpolation(name: str) -> Interpolation:
    try:
        return Interpolation(name)
    except ValueError:
        raise RangeError(f"interpolation is {name!r} (expected {', '.join(Interpolation)})") from None


def _tangents(values: ArrayLike | None, shape: tuple[int, int], name: str) -> Floats | None:
    if values is None:
        return None
    tangents = arrays.as_floats(values, "K C", name=name)
    if tangents.shape != shape:
        raise ShapeError(f"{name} have shape {tangents.shape} (expected {shape})")
    return tangents


def share_time_axes(tracks: Iterable[Track]) -> list[Track]:
    """Return the tracks with one axis for equal times."""
    axes: dict[bytes, TimeAxis] = {}
    found = [(track, axes.setdefault(track.times.tobytes(), track.time_axis)) for track in tracks]
    return [track if track.time_axis is axis else replace(track, time_axis=axis) for track, axis in found]
