"""Influence radius of morphed meshes: those on one node against the route of skinned ones."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.continuous_bound import influence_radius as module
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.point_groups import SkinnedGroups
from anim.measure.error.surface import Surface
from tests.anim.measure.error.brute_force import points_on_a_node

RNG = np.random.default_rng(5)


@pytest.mark.parametrize("is_turned", [False, True])
def test_targets_of_a_mesh_on_one_node(is_turned: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    targets = RNG.normal(size=(4, 7, 3))
    scene = points_on_a_node(RNG.normal(size=(7, 3)).tolist(), targets=targets.tolist())
    (part,) = ErrorMetric(scene).combined
    assert isinstance(part, SkinnedGroups)
    if is_turned:
        bind = RNG.normal(size=(1, 3, 4))
        monkeypatch.setattr(part, "old", part.old._replace(bind=bind))
        monkeypatch.setattr(part, "new", part.old)
    found = module.influence_radius(part)
    with monkeypatch.context() as patched:
        patched.setattr(Surface, "is_rigid", False)
        expected = module.influence_radius(part)
    assert found is not None
    assert expected is not None
    assert found.morphing is not None
    assert expected.morphing is not None
    np.testing.assert_allclose(found.morphing.targets, expected.morphing.targets, rtol=1e-14)
    if not is_turned:
        np.testing.assert_array_equal(found.morphing.targets, expected.morphing.targets)
        np.testing.assert_allclose(found.morphing.targets[0], np.linalg.norm(targets, axis=2).max(axis=1), rtol=1e-14)
