"""Tracks that move no node: nowhere off by more than a share of their range."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import AccessorFormat
from anim.optimization.tracks.key_reduction import reduce_pointer_keys
from anim.sampling.track import sample
from tests.clips import STEP, about, track

TIMES = np.linspace(0, 2, 81)
WAVE = np.sin(np.outer(TIMES, [3.0, 1.0, 0.2])) * [1, 100, 0.01]


@pytest.mark.parametrize("bound", [0.1, 1e-2, 1e-3])
def test_nowhere_off_by_more_than_its_share(bound: float) -> None:
    before = track("/materials/0/emissiveFactor", TIMES, WAVE)
    after = reduce_pointer_keys(before, bound)
    at = np.linspace(0, 2, 4001)
    extent = np.ptp(WAVE, axis=0).max()
    assert np.abs(sample(after, at) - sample(before, at)).max() <= bound * extent
    assert len(after.times) < 81
    assert (after.times[0], after.times[-1]) == (0, 2)


def test_scale_of_the_values_does_not_matter() -> None:
    counts = {len(reduce_pointer_keys(track("/x", TIMES, factor * WAVE), 1e-2).times) for factor in (1e-9, 1, 1e9)}
    assert len(counts) == 1


@pytest.mark.parametrize("bound", [0.0, 0.1])
def test_jumps_keep_every_key_that_changes_something(bound: float) -> None:
    steps = track("/materials/0/alphaCutoff", [0, 1, 2, 3], [[0.1], [0.1], [0.100001], [0.2]], STEP)
    after = reduce_pointer_keys(steps, bound)
    assert (after.times.tolist(), after.interpolation) == ([0, 2, 3], STEP)
    whole = AccessorFormat(5121)
    flags = reduce_pointer_keys(track("/nodes/0/visible", [0, 1, 2], [[1], [1], [0]], STEP, storage=whole), bound)
    assert (flags.times.tolist(), flags.storage) == ([0, 2], whole)


def test_no_allowance_no_change() -> None:
    before = track("/materials/0/emissiveFactor", TIMES, WAVE)
    assert (reduce_pointer_keys(before, 0).values == before.values).all()


def test_constants_become_one_key() -> None:
    assert reduce_pointer_keys(track("/x", TIMES, np.ones((81, 2))), 0.1).times.tolist() == [0]


def test_turns_of_pointers_are_measured_as_turns() -> None:
    before = track("/extensions/EXT_lights_image_based/lights/0/rotation", TIMES, about("y", 170 * TIMES))
    after = reduce_pointer_keys(before, 1e-2)
    at = np.linspace(0, 2, 801)
    assert 2 < len(after.times) < 81
    assert np.abs(sample(after, at) - sample(before, at)).max() < 1.1e-2
