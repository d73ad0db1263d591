"""Steps between the keys of dense rotation tracks, for rules about pops, jumps and jitter."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.track_table import TrackTable
from anim.maths import quaternion
from anim.model import Interpolation, Track

MIN_KEYS = 6


class RotationSteps(NamedTuple):
    """Keys (S, 4) of LINEAR rotation tracks with continuous signs, one track after the other.

    steps: (S, 4), twice the difference to the key before: its length is the angle in rad for small steps; 0 at the
    first key of a track. is_inner: (S,), True for keys with two neighbors on each side.
    """

    table: TrackTable
    keys: Floats
    steps: Floats
    is_inner: Bools

    @property
    def angles(self) -> Floats:
        """Length of each step (S,), rad."""
        return np.asarray(np.sqrt((self.steps**2).sum(axis=1)))

    def cosines(self) -> Floats:
        """Cosine of the angle (S,) between the step to a key and the step from it; 1 where there is none."""
        following = np.roll(self.steps, -1, axis=0)
        lengths = self.angles * np.sqrt((following**2).sum(axis=1))
        dots = (self.steps * following).sum(axis=1)
        return np.asarray(np.where(self.is_inner & (lengths > 0), dots / np.where(lengths > 0, lengths, 1), 1.0))


def rotation_steps(file: CheckedFile) -> Iterator[RotationSteps]:
    """Yield the steps of all LINEAR rotation tracks with at least MIN_KEYS keys, those of some tracks at a time."""
    return map(steps_of, file.tracks("rotation", _is_dense))


def steps_of(table: TrackTable) -> RotationSteps:
    """Return the steps of rotation tracks."""
    inner = table.inner_steps()
    dots = np.ones(len(table.values))
    dots[1:] = quaternion.dot(table.values[1:], table.values[:-1])
    signs = np.cumprod(np.where(inner & (dots < 0), -1.0, 1.0))
    keys = table.values * signs[:, None]
    steps = np.zeros_like(keys)
    steps[1:] = 2 * (keys[1:] - keys[:-1])
    steps[~inner] = 0.0
    index = np.arange(len(keys)) - np.repeat(table.starts, table.counts)
    left = np.repeat(table.counts, table.counts) - 1 - index
    return RotationSteps(table, keys, steps, np.asarray((index >= 2) & (left >= 2)))


def _is_dense(track: Track) -> bool:
    return track.interpolation is Interpolation.LINEAR and len(track.values) >= MIN_KEYS
