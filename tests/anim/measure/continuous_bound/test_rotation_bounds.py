"""Majorants of rotations and of whole trees, against derivatives by differences of the very matrices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.arrays import Floats
from anim.maths import hierarchy
from anim.measure.continuous_bound.intervals import Intervals, merge_intervals
from anim.measure.continuous_bound.node_bounds import local_bounds, world_bounds
from anim.measure.continuous_bound.node_tracks import ClipSpan
from anim.measure.continuous_bound.track_partition import partition_tracks
from anim.measure.error.sample_times import dense_times
from anim.model import Clip, Scene
from anim.sampling import world_matrices
from anim.sampling.players import PLAYERS, sampler_for
from tests.anim.measure.continuous_bound.making import pair
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, skeleton, track

STEPS = 2e-3  # of a gap, for differences


def _derivatives(of: Scene, moving: Clip, where: Intervals, player: str, share: float) -> Floats:
    """World matrices (3, N, G, 3, 4) with two derivatives, a share of the way through gaps, by differences."""
    poses = sampler_for(of.skeleton, moving, player=player)
    at, step = where.starts + share * where.lengths, STEPS * where.lengths
    left, here, right = (world_matrices(of.skeleton, poses.at(at + k * step)).swapaxes(0, 1) for k in (-1, 0, 1))
    step = step[:, None, None]
    return np.stack((here, (right - left) / (2 * step), (right - 2 * here + left) / step**2))


@given(st.integers(0, 100_000), st.sampled_from(list(PLAYERS)), st.floats(0.05, 0.95))
@settings(max_examples=40)
def test_no_derivative_exceeds_its_majorant(seed: int, player: str, share: float) -> None:
    of, before, after = pair(seed, modes=(STEP, LINEAR, LINEAR, CUBICSPLINE))
    where = merge_intervals(dense_times(before, after), before, after)
    where = Intervals(where.edges[np.concatenate(([True], np.diff(where.edges) > 1e-4))])  # differences need room
    if len(where) < 1 or not {t for each in (before, after) for t in each.key_times} <= set(where.edges):
        return
    with np.errstate(all="ignore"):
        found = world_bounds([ClipSpan(partition_tracks((of, of), (before, after)), where)], players=[player])
    a, b = (_derivatives(of, each, where, player, share) for each in (before, after))
    for bounds, part in ((found.matrices, np.s_[..., :3]), (found.origins, np.s_[..., 3:])):
        sizes = np.linalg.norm(a[part], 2, axis=(-1, -2)), np.linalg.norm((b - a)[part], 2, axis=(-1, -2))
        apart = bounds[:, 1] - bounds[:, 0]
        for k in range(3):
            noise = 1e-12 / (STEPS * where.lengths) ** k + 1e-4 * (k > 0) * sizes[0][k]
            with np.errstate(invalid="ignore"):
                assert not (sizes[0][k] > bounds[k, 0] * (1 + 1e-9) + noise).any()
                assert not (sizes[1][k] > apart[k] * (1 + 1e-9) + noise).any()


def test_a_turn_at_constant_speed_is_bounded_exactly() -> None:
    """|R| = 1, |R′| = ω, |R″| = ω²; of two turns about one axis |ΔR″| = |ω₂² − ω₁²| and what has come of it."""
    of = Scene(skeleton([-1]), ())
    slow, fast = (clip(track("rotation", [0, 0.01], about("z", [0, degrees]))) for degrees in (1.0, 1.001))
    where = Intervals(np.array([0.0, 0.01]))
    found = local_bounds([ClipSpan(partition_tracks((of, of), (slow, fast)), where)], players=["spec"]).matrices[
        :, :, 0, 0
    ]
    first, second = np.radians([100, 100.1])
    assert found[:, 0] == pytest.approx([1, first, first**2], rel=1e-4)
    assert found[2, 1] - found[2, 0] == pytest.approx(second**2 - first**2, rel=0.02)


def test_a_jump_is_bounded_exactly() -> None:
    """A key 1 ‰ too long: at its end a wide turn of three.js leaves a matrix that is 2 ‰ off a rotation's."""
    of = Scene(skeleton([-1, 0], translation=[[0, 0, 0], [3, 0, 0]]), ())
    keys = about("z", [0, 60, 61]) * np.array([[1], [1.001], [1]])
    moving = clip(track("rotation", [0, 0.01, 0.02], keys))
    where = Intervals(np.array([0.0, 0.01, 0.02]))
    jumps = world_bounds([ClipSpan(partition_tracks((of, of), (moving, moving)), where)], players=["three"]).jumps
    poses = sampler_for(of.skeleton, moving, player="three").at(np.array([np.nextafter(0.01, 0), 0.01]))
    before, after = world_matrices(of.skeleton, poses)
    assert jumps[0, 0, 0] == pytest.approx(2 * 2 * (1.001**2 - 1))  # of both versions
    assert np.linalg.norm((after - before)[1, :, 3]) <= jumps[1, 1, 0] / 2 <= 3.01 * 2 * (1.001**2 - 1)
    assert not jumps[:, :, 1].any()


def test_deep_trees_have_the_bounds_of_a_step_per_level(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines, STEP and keys that are too long, which jump; a trunk with branches."""
    parents = [*range(-1, 299), 5, *range(300, 320)]
    of = Scene(skeleton(parents, translation=np.tile([0.01, 0.02, 0], (len(parents), 1))), ())
    random = np.random.default_rng(0)
    times = np.array([0, 0.02, 0.04])
    versions = []
    for length in (1.0, 1.0001):
        turns = [about("z", 0.1 * random.normal(size=3)) * [[1], [length], [1]] for _ in parents]
        versions.append(clip(*(track("rotation", times, keys, node=i) for i, keys in enumerate(turns))))
    span = ClipSpan(partition_tracks((of, of), (versions[0], versions[1])), Intervals(times))
    found = world_bounds([span], players=["three"])
    monkeypatch.setattr(hierarchy, "MIN_DEPTH", 1000)
    expected = world_bounds([span], players=["three"])
    assert expected.jumps.any()
    for name in ("matrices", "origins", "jumps"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-10)
