"""Mean, p99, turn, speed and weights against scipy and a plain loop over vertices, and against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.reading import reader
from anim.measure.error import metric
from anim.measure.error.displacement import MorphedDisplacement
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times, key_and_mid_times
from anim.measure.error.statistics import FRAMES, SLACK, Peak, speed_error, statistics
from anim.model import Clip, Mesh, MeshInstance, Scene, TimeAxis, Track
from anim.operations.resample import resample
from anim.sampling.times import frame_times
from tests.anim.measure.error.plain_positions import plain_vertices, plain_world
from tests.clips import CUBICSPLINE, STEP, about, clip, skeleton, track
from tests.files import opened_fixture, opened_path

Find = Callable[[str], Path]
NOTHING = np.empty(0)


# Against scipy's slerp, 4 x 4 matrices, and one vertex after the other


@pytest.fixture(params=["biped", "arm"])
def versions(request: pytest.FixtureRequest) -> tuple[Scene, Clip, Clip]:
    """A skinned scene, a clip of it made linear, and that a little slower."""
    document = opened_fixture(request.param)
    before = resample(reader.clips(document)[0], fps=11)
    slower = tuple(replace(each, time_axis=TimeAxis(1.1 * each.times)) for each in before.tracks)
    return reader.scene(document), before, Clip(before.name, slower)


@pytest.mark.parametrize("player", ["spec", "nlerp"])
def test_poses_of_the_error_give_the_same_statistics(versions: tuple[Scene, Clip, Clip], player: str) -> None:
    scene, before, after = versions
    ruler, times = ErrorMetric(scene, shell=0.1), dense_times(before, after)
    block = ruler.sample_errors(before, after, times, players=(player,)).block
    assert block is not None
    assert len(times) > FRAMES
    alone = statistics(ruler, before, after, times=times, player=player)
    found = statistics(ruler, before, after, times=times, block=block, player=player)
    assert found._replace(speed=alone.speed) == alone
    assert found.speed.size == pytest.approx(alone.speed.size, rel=1e-5)  # of keys within 1 µs of the frames


def test_speeds_are_of_the_grid_alone(versions: tuple[Scene, Clip, Clip]) -> None:
    """Poses between its frames are left out; without one of its frames it is posed itself."""
    scene, before, after = versions
    ruler, times = ErrorMetric(scene), dense_times(before, after, fps=40)
    block = ruler.sample_errors(before, after, times).block
    for fps in (40, 41):
        alone = speed_error(ruler, before, after, fps=fps)
        found = speed_error(ruler, before, after, fps=fps, block=block)
        assert found.size == pytest.approx(alone.size, rel=1e-5)


def test_only_poses_of_one_player_and_block_are_kept(
    versions: tuple[Scene, Clip, Clip], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, before, after = versions
    ruler, times = ErrorMetric(scene), dense_times(before, after)
    assert ruler.sample_errors(before, after, times, players=("spec", "nlerp")).block is None
    monkeypatch.setattr(metric, "BLOCK", 100)
    assert ruler.sample_errors(before, after, times).block is None


def test_a_plain_loop_finds_the_same(versions: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = versions
    times = key_and_mid_times(before, after)[::9][:FRAMES]
    found = statistics(ErrorMetric(scene), before, after, times=times)
    apart = np.array([[np.linalg.norm(v) for v in _apart(scene, before, after, time)] for time in times])
    assert apart.max() > 0.001
    assert found.mean == pytest.approx(apart.mean(), rel=1e-6)
    ordered = np.sort(apart.reshape(-1))
    assert found.p99 == pytest.approx(ordered[int(np.ceil(0.99 * len(ordered))) - 1], rel=1e-6)
    assert statistics(ErrorMetric(scene, shell=0.01), before, after, times=times).mean == found.mean
    largest = ErrorMetric(scene).error_at(before, after, times)
    assert apart.max() - 1e-12 <= largest.max_error <= 1.001 * apart.max()
    frame = int(np.flatnonzero(times == largest.time)[0])
    assert apart[frame, largest.vertex] == pytest.approx(apart.max(), rel=1e-3)


def test_speeds_are_differences_on_the_grid(versions: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = versions
    times = frame_times(0.0, max(before.end, after.end), fps=6)
    apart = np.array([_apart(scene, before, after, time) for time in times])
    speeds = np.linalg.norm(np.diff(apart, axis=0), axis=2) / np.diff(times)[:, None]
    found = speed_error(ErrorMetric(scene), before, after, fps=6)
    assert speeds.max() - 1e-9 <= found.size <= SLACK * speeds.max()
    frame = int(np.argmin(np.abs((times[1:] + times[:-1]) / 2 - found.time)))
    assert speeds[frame, found.vertex] >= speeds.max() / SLACK - 1e-9


def test_turns_are_those_of_the_world(versions: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = versions
    times = key_and_mid_times(before, after)[::3]
    found = statistics(ErrorMetric(scene), before, after, times=times)
    angles = [
        (one[1].inv() * other[1]).magnitude()
        for time in times
        for one, other in zip(*(plain_world(scene.skeleton, each, time) for each in (before, after)), strict=True)
    ]
    assert found.angle.size == pytest.approx(max(angles), abs=1e-7)


def test_blocks_don_t_show(versions: tuple[Scene, Clip, Clip], monkeypatch: pytest.MonkeyPatch) -> None:
    """However few times are gone through at once, the answer is the same."""
    scene, before, after = versions
    times = dense_times(before, after)
    whole = ErrorMetric(scene, shell=0.01).error_at(before, after, times), statistics(ErrorMetric(scene), before, after)
    monkeypatch.setattr(metric, "BLOCK", 1)
    assert len(list(ErrorMetric(scene).blocks(before, after, times))) > 10
    parts = ErrorMetric(scene, shell=0.01).error_at(before, after, times), statistics(ErrorMetric(scene), before, after)
    assert parts[0].max_error == pytest.approx(whole[0].max_error, rel=1e-3)
    assert parts[1].mean == pytest.approx(whole[1].mean, rel=1e-6)
    assert parts[1].speed.size == pytest.approx(whole[1].speed.size, rel=0.01)
    assert parts[1].angle == whole[1].angle


# Closed forms


def test_a_point_that_hurries() -> None:
    """At 1 m/s against 3 m/s over one second: 2 m/s all the way; half of the distances are above 1 m."""
    scene = _points([[0, 0, 0]])
    before, after = (clip(track("translation", [0, 1], np.array([[0, 0, 0], [s, 0, 0]]))) for s in (1, 3))
    found = statistics(ErrorMetric(scene), before, after, times=np.linspace(0, 1, 51))
    assert found.speed.size == pytest.approx(2, rel=0.01)
    assert found.mean == pytest.approx(1)
    assert found.p99 == pytest.approx(2 * 0.99, abs=0.03)
    assert found.angle == Peak()


def test_a_step_is_as_fast_as_a_frame() -> None:
    """A jump of 0.1 m within one frame of 120 a second is 12 m/s, whatever happens elsewhere."""
    jump = clip(track("translation", [0, 0.5, 1], np.array([[0, 0, 0], [0, 0.1, 0], [0, 0.1, 0]]), STEP))
    still = clip(track("translation", [0, 1], np.zeros((2, 3))))
    found = speed_error(ErrorMetric(_points([[0, 0, 0]])), still, jump)
    assert found.size == pytest.approx(12, rel=0.01)
    assert found.time == pytest.approx(0.5, abs=1 / 120)


def test_turns_add_up_down_the_chain() -> None:
    nodes = skeleton([-1, 0, 1])
    after = clip(*(track("rotation", [0], about("z", [d]), node=n) for n, d in ((0, 1), (1, 2), (2, 4))))
    found = statistics(ErrorMetric(Scene(nodes, ())), clip(), after)
    assert np.degrees(found.angle.size) == pytest.approx(7)
    assert found.angle.joint == "2"


def test_morph_weights_by_hand() -> None:
    """A target of 2 m whose weight is off by a quarter at its peak, and gets there within half a second."""
    scene = _points([[0, 0, 0], [1, 0, 0]], targets=[[[0, 0, 0], [0, 2, 0]], [[0, 0, 0], [0, 0, 1]]])
    before = clip(track("weights", [0, 0.5, 1], np.zeros((3, 2))))
    after = clip(track("weights", [0, 0.5, 1], np.array([[0, 0], [0.25, 0], [0, 0]])))
    found = statistics(ErrorMetric(scene), before, after)
    assert found.weight == Peak(0.25, 0.5, "0", "0", 0)
    assert found.speed.size == pytest.approx(2 * 0.25 / 0.5, rel=0.01)
    assert found.speed.vertex == 1


def test_morphs_and_skins_together_are_a_plain_sum(asset: Find) -> None:
    """BitmojiRun has 73 targets and 22 joints; with a weight that moves both ways of skinning must agree."""
    document = opened_path(asset("BitmojiRun.glb"))
    scene = reader.scene(document)
    (instance,) = scene.instances
    before = Clip("", tuple(each for each in reader.clips(document)[0].tracks if each.path != "weights"))
    end = before.end
    weights = np.tile(instance.weights, (3, 1))
    weights[1, 5] += 0.5
    moving = Clip("", (*before.tracks, track("weights", [0, end / 2, end], weights, node=instance.node)))
    found = ErrorMetric(scene).error_at(before, moving, np.array([end / 2]))
    alone = np.abs(0.5 * np.linalg.norm(instance.mesh.targets[5], axis=1)).max()
    assert found.max_error == pytest.approx(alone, rel=1e-3)  # joints turn, but don't scale
    assert statistics(ErrorMetric(scene), before, moving).weight.vertex == 5


def test_bounds_hold_where_skin_is_morphed_too(asset: Find) -> None:
    """No vertex is farther, or faster, than the search says, which goes through a few of them only."""
    document = opened_path(asset("BitmojiRun.glb"))
    before = reader.clips(document)[0]
    slower = Clip("", tuple(replace(each, time_axis=TimeAxis(1.07 * each.times)) for each in before.tracks))
    ruler = ErrorMetric(reader.scene(document))
    times = frame_times(0.0, slower.end, fps=60)
    found = ruler.error_at(before, slower, times), speed_error(ruler, before, slower, fps=60)
    (block,) = ruler.blocks(before, slower, times)
    (part,) = ruler.parts
    field = part.field(block.old, block.new)
    assert isinstance(field, MorphedDisplacement)
    frames = np.arange(len(times))
    apart = np.concatenate([field.vectors(group, frames) for group in range(len(part.groups))])
    largest = np.linalg.norm(apart, axis=1).max()
    fastest = (np.linalg.norm(np.diff(apart, axis=2), axis=1) / np.diff(times)).max()
    assert largest * (1 - 1e-12) <= found[0].max_error <= 1.001 * largest
    assert fastest * (1 - 1e-12) <= found[1].size <= SLACK * fastest


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_model_of_any_size_is_measured_alike(factor: float) -> None:
    document = opened_fixture("biped")
    scene, before = reader.scene(document), reader.clips(document)[0]
    after = resample(before, fps=7)
    nodes = scene.skeleton
    scale = np.where((nodes.parents < 0)[:, None], factor * nodes.scale, nodes.scale)
    roots = {n for n in range(len(nodes)) if nodes.parents[n] < 0}
    place = np.where((nodes.parents < 0)[:, None], factor * nodes.translation, nodes.translation)
    large = replace(scene, skeleton=replace(nodes, scale=scale, translation=place))
    plain, other = ErrorMetric(scene, shell=0.01), ErrorMetric(large, shell=0.01)
    resized = [Clip("", tuple(_times(factor, e) if e.node in roots else e for e in c.tracks)) for c in (before, after)]
    assert other.diagonal == pytest.approx(factor * plain.diagonal)
    expected = factor * plain.error(before, after).max_error
    assert other.error(*resized).max_error == pytest.approx(expected, rel=2e-3)


def _times(factor: float, each: Track) -> Track:
    if each.path != "translation":
        assert each.path == "rotation"
        return each
    tangents = [None if t is None else factor * t for t in (each.in_tangents, each.out_tangents)]
    return replace(each, values=factor * each.values, in_tangents=tangents[0], out_tangents=tangents[1])


def test_the_same_clip_is_exactly_0_away() -> None:
    for name in ("biped", "morph_cube", "interpolations"):
        document = opened_fixture(name)
        ruler = ErrorMetric(reader.scene(document), reader.scene(opened_fixture(name)), shell=0.01)
        for each in reader.clips(document):
            assert ruler.error_at(each, each, dense_times(each)).max_error == 0
            found = statistics(ruler, each, each)
            assert (found.mean, found.p99, found.angle, found.speed, found.weight) == (0, 0, Peak(), Peak(), Peak())


def test_dense_times_hold_keys_middles_a_grid_and_the_last_moment_of_steps() -> None:
    before = clip(track("translation", [0.1, 0.3], np.zeros((2, 3)), STEP))
    spline = track("scale", [0.2, 0.4], np.ones((2, 3)), CUBICSPLINE, tangents=(np.zeros((2, 3)), np.zeros((2, 3))))
    times = dense_times(before, clip(spline), fps=10)
    for time in (0.1, 0.15, 0.2, 0.25, np.nextafter(0.3, 0), 0.3, 0.35, 0.4):
        assert np.abs(times - time).min() <= 1e-15
    assert np.nextafter(0.3, 0) in times.tolist()
    assert (np.diff(times) > 0).all()


def test_dense_times_begin_a_frame_before_the_first_key_however_late_that_is() -> None:
    """Some players hold a key otherwise than they play it; of what is held one look is enough."""
    for first, before in ((0.0, 0.0), (0.5, 0.4), (0.5 + 1e-8, 0.4), (0.55, 0.5), (86400.0, 86399.9)):
        times = dense_times(clip(track("translation", [first, first + 1], np.zeros((2, 3)))), fps=10)
        assert times[0] == pytest.approx(before, abs=1e-9)
        assert first in times.tolist()
        assert 11 <= len(times) <= 15


def _points(points: list[list[float]], *, targets: list[list[list[float]]] | None = None) -> Scene:
    """Points on one node, without a skin."""
    count = len(points)
    moved = np.array(targets, float) if targets else np.empty((0, count, 3))
    none = np.empty((count, 0))
    faces = np.empty((0, 3), np.int64)
    rest = np.zeros(len(moved))
    mesh = Mesh("points", np.array(points, float), faces, none.astype(np.int64), none, moved, rest)
    return Scene(skeleton([-1]), (MeshInstance(0, mesh, None, rest),))


def _apart(scene: Scene, before: Clip, after: Clip, time: float) -> Floats:
    """How far every vertex is displaced (V, 3), by sums over joints of 4 x 4 matrices."""
    return np.array(plain_vertices(scene, after, time)) - np.array(plain_vertices(scene, before, time))


def test_without_vertices_the_points_of_shells_count() -> None:
    """A lone node goes 2 mm astray at its last key: half of it on the mean, whether by shells or by cubes."""
    scene = Scene(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), ())
    way = np.array([[0.0, 0, 0], [1, 0, 0]])
    before, after = (clip(track("translation", [0, 1], way + [[0], [lift]] * np.eye(3)[1])) for lift in (0, 0.002))
    times = np.linspace(0, 1, 11)
    for ruler in (ErrorMetric(scene, shell=0.01), ErrorMetric(scene)):
        found = statistics(ruler, before, after, times=times)
        assert [found.mean, found.p99] == pytest.approx([0.001, 0.002])
