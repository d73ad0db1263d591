"""Bounds of quaternions on cubics, which all players normalize."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.measure.continuous_bound.quaternion_bounds import MIN_MIX_LENGTH, QuaternionBounds, arc_mix, directed, nearest


def with_cubics(found: QuaternionBounds, value: Floats, cubic: Floats, is_cubic: Bools, h: Floats) -> QuaternionBounds:
    """Return the bounds with those of cubic tracks replaced.

    value, cubic: (2, 4, P, L) the mixes at both ends, and (2, 2, 4, P, L) their first and second derivatives.
    is_cubic: (L,). h: (L,) s.
    """
    own, most_own, own_rate = np.zeros_like(found.value), np.zeros_like(found.size), np.zeros_like(found.size)
    whole = found._replace(own=own, max_residual=most_own, residual_rate=own_rate)
    part = on_cubics(value[..., is_cubic], cubic[0][..., is_cubic], cubic[1][..., is_cubic], h[is_cubic])
    for name in QuaternionBounds._fields:
        getattr(whole, name)[..., is_cubic] = getattr(part, name)
    return whole


def on_cubics(value: Floats, slope: Floats, bend: Floats, h: Floats) -> QuaternionBounds:
    """Return the bounds of cubics with values, slopes and second derivatives (2, 4, P, L) at both ends."""
    of = arc_mix(value, slope)
    push = np.sqrt((bend * bend).sum(axis=1).max(axis=0))  # no |c″| is larger
    jerk = np.sqrt(((bend[1] - bend[0]) ** 2).sum(axis=0)) / h  # |c‴|, constant
    rate = np.sqrt(of.rate.max(axis=0)) + h * h / 8 * jerk
    least, most = _min_norm(value, h) - h * h / 8 * push, np.sqrt(of.square.max(axis=0)) + h * h / 8 * push
    least = np.where(least > MIN_MIX_LENGTH, least, np.nan)
    drag, speed = of.along / of.square, rate / least
    most_drag = (np.abs(of.along).max(axis=0) + h / 2 * (rate * rate + most * push)) / least**2
    direction, tilt = directed(of, drag)
    own = (bend - direction * (direction * bend).sum(axis=1)[:, None]) / np.sqrt(of.square)[:, None]
    own_rate = jerk / least + (2 * speed + most_drag) * push / least
    most_own = np.sqrt((own * own).sum(axis=1).max(axis=0)) + h / 2 * own_rate
    pull, pull_rate = (tilt * tilt).sum(axis=1), 4 * most_drag * speed**2 + 2 * speed * most_own
    drag_rate = speed**2 + most_drag**2 + push / least
    size, excess = np.ones_like(speed), np.zeros((3, *speed.shape))
    figures = (size, speed, pull, speed**2, pull_rate, drag, most_drag, drag_rate, excess)
    return QuaternionBounds(direction, tilt, *figures, own, most_own, own_rate)


def _min_norm(value: Floats, h: Floats) -> Floats:
    """The smallest length on the chord (P, L)."""
    chord = (value[1] - value[0]) / h
    square, along, rate = ((x * y).sum(axis=0) for x, y in ((value[0],) * 2, (value[0], chord), (chord, chord)))
    return np.asarray(np.sqrt(nearest(square, along, rate, h)))
