"""Majorants: upper bounds of a motion, its first two derivatives, and those of another version of it.

A majorant is an array (3, 2, ...). [k, 0] bounds the k-th derivative of the first version at any time of an interval;
[k, 1] is [k, 0] plus a bound of the difference of the k-th derivatives. So [k, 1] bounds the second version, and
[k, 1] − [k, 0] the difference. Both rows multiply by Leibniz' rule, and their difference bounds the difference of the
products: b·y − a·x = (b − a)·y + a·(y − x). Hence nothing is lost for equal versions, however fast they move. A third
row, if present, is a third version of the same kind.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats


def derivative_bound(first: Floats, apart: Floats) -> Floats:
    """Return the majorant (3, 2, ...) of a motion bounded by `first` (3, ...), differences up to `apart`."""
    return np.stack((first, first + apart), axis=1)


def resting(first: Floats, apart: Floats | float = 0.0) -> Floats:
    """Return the majorant (3, 2, ...) of a constant; first, apart: (...)."""
    result = np.zeros((3, 2, *first.shape))
    result[0, 0] = first
    result[0, 1] = first + apart
    return result


def product(a: Floats, b: Floats) -> Floats:
    """Return the majorant of the product of two motions, of matrices with matrices or with vectors."""
    result = np.empty((3, *np.broadcast_shapes(a.shape[1:], b.shape[1:])))
    np.multiply(a[0], b[0], out=result[0])
    np.multiply(a[1], b[0], out=result[1])
    result[1] += a[0] * b[1]
    np.multiply(a[2], b[0], out=result[2])
    result[2] += 2 * a[1] * b[1]
    result[2] += a[0] * b[2]
    return result
