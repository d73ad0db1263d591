"""Validation of arrays: type, named shape, finiteness, read-only; equal values."""

from __future__ import annotations

import math
import operator
from collections.abc import Hashable, Iterable
from dataclasses import fields
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from anim.errors import DataRangeError, ShapeError

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]
AnyArray: TypeAlias = NDArray[Any]
Bytes: TypeAlias = NDArray[np.uint8]
Number = TypeVar("Number", np.float64, np.int64)
Key = TypeVar("Key", bound=Hashable)

MAX_SINGLE_M = 1e15  # of coordinates in float32: their squares, and sums of these, are finite
MIN_SUMMED = 1 << 13  # numbers; the sum of fewer squares is no faster than a look at each
_FLOAT64 = np.dtype(np.float64)
_NO_NUMBERS = {"U": "text", "S": "bytes", "M": "dates", "m": "differences of dates", "V": "records"}  # kinds of arrays
_specs: dict[str, tuple[int, tuple[tuple[int, int], ...]]] = {}  # axes, and which of them have a fixed length


class Identity:
    """Objects as a key of dictionaries: equal to the same objects only, which it keeps alive.

    For arrays that tracks share, which have no hash of their values. Identity(a) == Identity(a.copy()) → False
    """

    __slots__ = ("_objects",)

    def __init__(self, *objects: object) -> None:
        self._objects = objects

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Identity) or len(self._objects) != len(other._objects):
            return False
        return all(map(operator.is_, self._objects, other._objects))

    def __hash__(self) -> int:
        return hash(tuple(map(object.__hash__, self._objects)))


def as_floats(values: ArrayLike, shape: str, *, name: str = "array") -> Floats:
    """Return `values` as a read-only float64 array of the named shape, every number finite.

    shape: one word per axis, a number for a fixed length and a letter for any: "K 3", "F N 4", "K C".
    Writable arrays, and read-only views of them, are copied; immutable ones are shared.
    Raises ShapeError for a wrong shape or type, DataRangeError for NaN or infinity.
    as_floats([[0, 1, 2]], "K 3") → array of shape (1, 3)
    """
    array = _as_float64(values, name)
    check_shape(array, shape, name=name)
    if not is_finite(array):
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise DataRangeError(f"{name} holds {array[at]} at {list(at)} (expected finite numbers)")
    if _is_frozen(array):
        return array
    fresh = isinstance(values, list | tuple) or (isinstance(values, np.ndarray) and values.dtype != array.dtype)
    return freeze(array) if fresh else own(array)


def as_times(values: ArrayLike, *, name: str = "times") -> Floats:
    """Return any times (F,) in seconds as a read-only float64 array, finite; a single number is one time."""
    return as_floats(np.atleast_1d(_as_float64(values, name)), "F", name=name)


def as_key_times(values: ArrayLike, *, name: str = "times") -> Floats:
    """Return key times (K,) in seconds as a read-only float64 array: K ≥ 1, finite, ≥ 0, increasing.

    Times are strictly increasing. Raises ShapeError, or DataRangeError with the index of the first invalid key.
    """
    array = as_floats(values, "K", name=name)
    if len(array) == 0:
        raise DataRangeError(f"{name} are empty (expected at least one key)")
    if array[0] < 0:
        raise DataRangeError(f"{name} start at {array[0]:g} s (expected 0 s or later)")
    steps = np.diff(array)
    if len(steps) and steps.min() <= 0:
        k = int(np.argmax(steps <= 0)) + 1
        raise DataRangeError(f"{name} not increasing at key {k} ({array[k]:g} s after {array[k - 1]:g} s)")
    return array


def check_shape(array: AnyArray, shape: str, *, name: str = "array") -> None:
    """Raise ShapeError unless `array` has the named shape ("K 3": any length, then three)."""
    spec = _specs.get(shape)
    if spec is None:
        words = shape.split()
        spec = _specs[shape] = len(words), tuple((i, int(word)) for i, word in enumerate(words) if word.isdigit())
    axes, fixed = spec
    if array.ndim != axes or (fixed and any(array.shape[i] != length for i, length in fixed)):
        raise ShapeError(f"{name} has shape {array.shape} (expected ({', '.join(shape.split())}))")


def unique_sorted(values: NDArray[Number]) -> NDArray[Number]:
    """Return the distinct values in increasing order (np.unique loads a quarter of numpy for that)."""
    ordered = np.sort(values, kind="stable")  # merges sorted parts, as times mostly are
    return ordered[np.concatenate(([True], ordered[1:] > ordered[:-1]))] if len(ordered) else ordered


def group_indices(keys: Iterable[Key]) -> dict[Key, list[int]]:
    """Return the indices of equal keys, by key, in the order of the first ones.

    group_indices("abca") → {"a": [0, 3], "b": [1], "c": [2]}; of the parents of nodes: the children of each
    """
    found: dict[Key, list[int]] = {}
    for i, key in enumerate(keys):
        found.setdefault(key, []).append(i)
    return found


def is_finite(array: AnyArray) -> bool:
    """Return whether every number is finite; of long arrays a finite sum of squares is a fast proof."""
    flat = array.reshape(-1)
    if len(flat) >= MIN_SUMMED:
        with np.errstate(over="ignore"):  # takes as long as looking at thousands
            if math.isfinite(flat.dot(flat)):
                return True
    return bool(np.count_nonzero(np.isfinite(flat)) == len(flat))


def _as_float64(values: ArrayLike, name: str) -> Floats:
    """Values as float64, those of a float64 array without a copy."""
    if type(values) is np.ndarray and values.dtype is _FLOAT64:
        return values
    if isinstance(values, np.ndarray) and type(values) is not np.ndarray and np.ma.is_masked(values):
        raise ShapeError(f"{name} has masked values (expected numbers)", help="choose with .compressed() or .filled()")
    try:
        array = np.asarray(values)
        if array.dtype.kind == "c":
            raise ShapeError(f"{name} has complex numbers (expected real ones)")
        if array.dtype.kind in _NO_NUMBERS:
            raise ShapeError(f"{name} holds something that is no number ({_NO_NUMBERS[array.dtype.kind]})")
        return np.asarray(array, np.float64)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} holds something that is no number ({error})") from None
    except OverflowError:
        raise DataRangeError(f"{name} holds a number beyond all floats (expected finite numbers)") from None


def own(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` itself if it is read-only, else a read-only copy, independent of later writes."""
    return array if _is_frozen(array) else freeze(array.copy(order="K"))


def freeze(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array without other references read-only, together with its base, and return it."""
    owner: object = array
    while isinstance(owner, np.ndarray):
        owner.flags.writeable = False
        owner = owner.base
    return array


def reduce_fields(instance: Any) -> tuple[Any, ...]:
    """Return what `__reduce__` of a frozen dataclass returns, so that arrays of copies are read-only too.

    Not by `__setstate__`, which dataclasses with slots replace before Python 3.11.4 (python/cpython#104035).
    """
    return _restore_fields, (type(instance), [getattr(instance, field.name) for field in fields(instance)])


def _restore_fields(kind: type[Any], values: list[Any]) -> Any:
    instance = object.__new__(kind)
    for field, value in zip(fields(kind), values, strict=True):
        object.__setattr__(instance, field.name, freeze(value) if isinstance(value, np.ndarray) else value)
    return instance


def _is_frozen(array: AnyArray) -> bool:
    """True if the memory of `array` is read-only through itself and through all of its bases."""
    owner: object = array
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            return False
        owner = owner.base
    return not isinstance(owner, bytearray)
