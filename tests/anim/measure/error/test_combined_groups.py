"""Several surfaces and players at once: the same vectors as one by one, and no error lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.measure.error.combined_groups import combine_groups
from anim.measure.error.max_displacement import MaxDisplacement
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.orientation_probes import shell_points
from anim.measure.error.point_groups import PointGroups, SkinnedGroups
from anim.measure.error.sample_times import dense_times
from anim.measure.error.shell_points import ShellPoints
from anim.measure.error.surface import surfaces
from anim.model import Clip, Scene
from anim.sampling.players import PLAYERS
from anim.sampling.pose import PoseSampler
from tests.anim.optimization.making import TIMES, scene, turning, waving
from tests.clips import about, clip, track


def _two_meshes() -> Scene:
    one = scene(3)
    (instance,) = one.instances
    small = replace(instance.mesh, name="small", positions=0.4 * instance.mesh.positions)
    return replace(one, instances=(instance, replace(instance, mesh=small)))


def _changed() -> Clip:
    """The waving clip, its tracks on three time axes, with errors."""
    parts = list(waving().tracks)
    parts[1] = track("rotation", TIMES[::2], 1.0005 * turning(1.48)[::2], node=1)
    parts[2] = track("rotation", TIMES[::3], turning(-0.8, (1, 2, 0))[::3], node=2)
    return clip(*parts, track("rotation", [0, 2], about("x", [0, 30]), node=4))


def test_joined_vectors_are_those_of_the_parts() -> None:
    of = _two_meshes()
    nodes = np.array([1, 3])
    shells = ShellPoints(nodes, nodes, shell_points(of.skeleton, nodes, 0.1))
    parts: list[PointGroups] = [*map(SkinnedGroups, surfaces(of)), shells]
    (joined,) = combine_groups(parts)
    times = np.linspace(0, 2, 9)
    old, new = (PoseSampler(of.skeleton, each).posed(times) for each in (waving(), _changed()))
    whole, group = joined.field(old, new), 0
    assert whole is not None
    for part in parts:
        own = part.field(old, new)
        assert own is not None
        for number in range(len(part.groups)):
            vectors = own.vectors(number, np.arange(9))
            assert whole.vectors(group, np.arange(9)) == pytest.approx(vectors, abs=1e-12)
            longest = np.linalg.norm(vectors, axis=1).max(axis=0)
            assert (whole.limits[group] >= longest * (1 - 1e-12)).all()
            found = MaxDisplacement(0.0, group, 0, 0, whole.limits)
            assert (joined.leader(group), joined.name_of(found)) == (part.leader(number), part.name)
            group += 1
    assert len(joined.groups) == group


def test_players_together_find_the_largest_error_of_each_alone() -> None:
    ruler, before, after = ErrorMetric(_two_meshes(), shell=0.01), waving(), _changed()
    times = dense_times(before, after)
    alone = {player: ruler.error_at(before, after, times, player=player) for player in PLAYERS}
    found = ruler.sample_errors(before, after, times, players=tuple(PLAYERS))
    worst = max(alone.values(), key=lambda each: each.max_error)
    assert found.error.max_error == pytest.approx(worst.max_error, rel=2e-3)
    assert alone[found.player].max_error >= worst.max_error * (1 - 2e-3)
    for player, error in alone.items():
        most = max(float(limits.max()) for limits in found.limits[player])
        assert most >= error.max_error * (1 - 1e-3) - 1e-12
