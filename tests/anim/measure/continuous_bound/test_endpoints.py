"""Vectors at both ends of gaps, and what they do not exceed between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.continuous_bound.endpoints import endpoints, slide_bounds
from anim.measure.continuous_bound.intervals import Intervals
from anim.measure.continuous_bound.node_tracks import NodeTracks
from anim.model import Interpolation, Track
from anim.sampling.lazy_batch import lazy_batches
from anim.sampling.track import sample
from tests.clips import CUBICSPLINE, LINEAR, STEP, track

WHERE = Intervals(np.array([0.0, 0.5, 1, 2, 3]))
KEYS = np.array([[1.0, 0, 0], [3, 0, 2], [3, 4, 0]])
TANGENTS = (np.array([[0.0, 1, 0], [2, 0, 0], [0, 0, 3]]), np.array([[1.0, 0, 1], [0, -2, 0], [0, 0, 1]]))


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=0))


@pytest.mark.parametrize("mode", [LINEAR, STEP, CUBICSPLINE])
def test_one_sided_values_and_slopes(mode: Interpolation) -> None:
    """Against the track itself, a little inside both ends of each gap."""
    moving = _track(mode)
    of = NodeTracks(np.array([7, 8]), np.zeros((2, 3)), lazy_batches([replace(moving, node=8)]), WHERE)
    found = endpoints([of])
    nothing, value, slope, bend = found.value[..., :4], *(each[..., 4:] for each in found)
    assert not nothing.any()
    for side, at, inward in ((0, WHERE.starts, 1e-5), (1, WHERE.ends, -1e-5)):
        near = [sample(moving, at + k * inward).T for k in (1, 2, 3)]
        assert value[side] == pytest.approx(near[0], abs=1e-4)
        assert slope[side] == pytest.approx((near[1] - near[0]) / inward, abs=2e-3)
        assert bend[side] == pytest.approx((near[2] - 2 * near[1] + near[0]) / inward**2, abs=1e-2)


@pytest.mark.parametrize("modes", [(LINEAR, LINEAR), (CUBICSPLINE, LINEAR), (CUBICSPLINE, CUBICSPLINE)])
def test_bounds_of_slides(modes: tuple[Interpolation, Interpolation]) -> None:
    a, b = _track(modes[0]), _track(modes[1], 0.1)
    both = [endpoints([NodeTracks(np.zeros(1, int), np.zeros((1, 3)), lazy_batches([each]), WHERE)]) for each in (a, b)]
    found = slide_bounds(both[0], both[1], WHERE.lengths, _length)
    for gap in range(len(WHERE)):
        t = np.linspace(WHERE.starts[gap], WHERE.ends[gap], 2001)[:-1]
        for row, motion in ((found[:, 0], sample(a, t)), (found[:, 1] - found[:, 0], sample(b, t) - sample(a, t))):
            jets = [motion, np.gradient(motion, t, axis=0), np.gradient(np.gradient(motion, t, axis=0), t, axis=0)]
            tops = [np.linalg.norm(jet[3:-3], axis=1).max() for jet in jets]
            assert all(top <= bound * 1.001 + 1e-6 for top, bound in zip(tops, row[:, gap], strict=True))
            assert row[2, gap] == pytest.approx(tops[2], rel=0.02, abs=1e-6)  # of a cubic, largest at an end


def _track(mode: Interpolation, off: float = 0.0) -> Track:
    tangents = TANGENTS if mode is CUBICSPLINE else None
    return track("translation", [0, 1, 2], KEYS + off, mode, tangents=tangents)
