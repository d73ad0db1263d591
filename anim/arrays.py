"""The one gate for arrays: type, named shape, finiteness, read-only."""

from __future__ import annotations

from typing import Any, TypeAlias
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from anim.errors import RangeError, ShapeError

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]
AnyArray: TypeAlias = NDArray[Any]

_checked_axes: WeakValueDictionary[int, AnyArray] = WeakValueDictionary()


def floats(values: ArrayLike, shape: str, *, name: str = "array") -> Floats:
    """Return `values` as a read-only float64 array of the named shape, every number finite.

    shape: one word per axis, a number for a fixed length and a letter for any: "K 3", "F N 4", "K C".
    Raises ShapeError for a wrong shape or type, RangeError for NaN or infinity.
    floats([[0, 1, 2]], "K 3") → array of shape (1, 3)
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} holds something that is no number ({error})") from None
    check_shape(array, shape, name=name)
    if not np.isfinite(array).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise RangeError(f"{name} holds {array[at]} at {list(at)} (expected finite numbers)")
    return read_only(array)


def times(values: ArrayLike, *, name: str = "times") -> Floats:
    """Return key times (K,) in seconds as a read-only float64 array: K ≥ 1, finite, ≥ 0, strictly increasing.

    The same array object is checked once only, since many tracks share one time axis.
    Raises ShapeError, or RangeError that names the first bad key.
    """
    if isinstance(values, np.ndarray) and _checked_axes.get(id(values)) is values:
        return values
    array = floats(values, "K", name=name)
    if len(array) == 0:
        raise RangeError(f"{name} are empty (expected at least one key)")
    if array[0] < 0:
        raise RangeError(f"{name} start at {array[0]:g} s (expected 0 s or later)")
    steps = np.diff(array)
    if len(steps) and steps.min() <= 0:
        k = int(np.argmax(steps <= 0)) + 1
        raise RangeError(f"{name} not increasing at key {k} ({array[k]:g} s after {array[k - 1]:g} s)")
    _checked_axes[id(array)] = array
    return array


def check_shape(array: AnyArray, shape: str, *, name: str = "array") -> None:
    """Raise ShapeError unless `array` has the named shape ("K 3": any length, then three)."""
    axes = shape.split()
    fits = array.ndim == len(axes) and all(
        not axis.isdigit() or length == int(axis) for axis, length in zip(axes, array.shape, strict=True)
    )
    if not fits:
        raise ShapeError(f"{name} has shape {array.shape} (expected ({', '.join(axes)}))")


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` itself if nobody can write to it through this object, else a read-only view of it."""
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array
