"""Morph weights in fewer keys: no vertex off by more than it says, by plain loops over vertices."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.error.surface import surfaces
from anim.model import Scene, Track
from anim.optimization.options import Packing
from anim.optimization.search.source_motion import key_grid
from anim.optimization.tracks.morph_weights import influence_radius, reduce_weights
from anim.sampling.track import sample
from tests.anim.skinning.scenes import mesh
from tests.anim.skinning.scenes import scene as made
from tests.clips import CUBICSPLINE, LINEAR, track

RNG = np.random.default_rng(29)
TARGETS = RNG.normal(size=(3, 12, 3))
TARGETS[:, 5] = 0  # a vertex that no target moves
TIMES = np.linspace(0, 3, 61)


def _scene() -> Scene:
    points = RNG.normal(size=(12, 3))
    return made(mesh(points, np.zeros((12, 1)), np.ones((12, 1)), targets=TARGETS), [-1])


def _reach(widening: float = 1.0) -> Floats:
    return influence_radius(surfaces(_scene()), 1, widening)


def _weights(low: float = 0.0, high: float = 1.0) -> Track:
    waves = 0.5 + 0.5 * np.sin(np.outer(TIMES, [1.0, 2.3, 0.4]) + np.arange(3))
    return track("weights", TIMES, low + (high - low) * waves, node=1)


def _moved(before: Track, after: Track) -> float:
    """How far any vertex is from its place at any of many times, m."""
    at = np.linspace(-0.1, 3.1, 1601)
    difference = sample(after, at) - sample(before, at)
    return max(float(np.linalg.norm(difference @ TARGETS[:, v], axis=1).max()) for v in range(12))


def test_reach_is_the_length_of_each_displacement() -> None:
    found = _reach(2.5)
    kept = [v for v in range(12) if v != 5]
    for column, v in enumerate(kept):
        for m in range(3):
            assert found[m, column] == pytest.approx(2.5 * np.sqrt((TARGETS[m, v] ** 2).sum()))
    assert found.shape == (3, 11)
    assert influence_radius(surfaces(_scene()), 0, 1.0).shape == (0, 0)


@pytest.mark.parametrize("packing", list(Packing))
@pytest.mark.parametrize("bound", [1.0, 1e-2, 1e-4])
@pytest.mark.parametrize("span", [(0.0, 1.0), (-0.7, 1.9)])
def test_no_vertex_leaves_its_path_by_more(packing: Packing, bound: float, span: tuple[float, float]) -> None:
    before = _weights(*span)
    after, stored, off = reduce_weights(before, _reach(), bound, key_grid([before]), packing)
    assert _moved(before, after) <= off * (1 + 1e-9) <= bound * (1 + 1e-9)
    assert (after.values == stored.values).all()
    assert after.interpolation is LINEAR
    assert len(after.times) < 30 or bound < 1


def test_weights_outside_0_and_1_are_not_clamped() -> None:
    before = _weights(-0.7, 1.9)
    for packing in Packing:
        after, _, _ = reduce_weights(before, _reach(), 1e-3, TIMES, packing)
        assert after.values.min() == pytest.approx(before.values.min(), abs=1e-3)
        assert after.values.max() == pytest.approx(before.values.max(), abs=1e-3)


def test_few_bits_where_they_do() -> None:
    loose, _, _ = reduce_weights(_weights(), _reach(), 0.5, TIMES, Packing.CORE)
    finer, _, _ = reduce_weights(_weights(), _reach(), 5e-3, TIMES, Packing.CORE)
    finest, _, _ = reduce_weights(_weights(), _reach(), 1e-6, TIMES, Packing.CORE)
    assert [each.storage.component_type for each in (loose, finer, finest)] == [5121, 5123, 5126]
    for each, scale in ((loose, 255), (finer, 65535)):
        assert each.values * scale == pytest.approx(np.round(each.values * scale), abs=1e-9)


def test_splines_become_lines_on_a_finer_grid() -> None:
    times, values = np.array([0.0, 1, 3]), RNG.random((3, 3))
    slopes = RNG.normal(size=(3, 3))
    spline = track("weights", times, values, CUBICSPLINE, tangents=(slopes, slopes), node=1)
    after, _, off = reduce_weights(spline, _reach(), 0.05, key_grid([spline]), Packing.CORE)
    assert _moved(spline, after) <= 1.05 * 0.05
    assert off <= 0.05


def test_constant_weights_become_one_key() -> None:
    still = track("weights", TIMES, np.tile([0.25, 0.5, 0.75], (61, 1)), node=1)
    after, _, off = reduce_weights(still, _reach(), 1e-2, TIMES, Packing.CORE)
    assert (len(after.times), off <= 1e-2) == (1, True)
