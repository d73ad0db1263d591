"""Quaternion tracks against scipy's Euler rotations, at keys and between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from anim.arrays import Floats
from anim.errors import RangeError, UnsupportedError
from anim.exchange.euler import from_euler as conversion
from anim.exchange.euler.baked_keys import KeyPlacement
from anim.exchange.euler.curve import Curve, Mode, constant, evaluate, linear, uniform_modes
from anim.exchange.euler.evaluate import evaluate_rotation, evaluate_translation
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import OFFSETS, EulerMotion, EulerNode, Pivots
from anim.maths import euler, quaternion
from anim.maths.euler import ORDERS, AxesConvention
from anim.model import Interpolation, TimeAxis, Track
from anim.sampling.track import sample

CONVENTIONS = [(order, frame) for order in ORDERS for frame in AxesConvention]
TOLERANCE = np.radians(0.05)
WIDEST = np.radians(120) + 1e-4


def _node(
    curves: Sequence[Curve | None], order: str = "XYZ", frame: AxesConvention = AxesConvention.INTRINSIC
) -> EulerNode:
    return EulerNode("a", -1, np.zeros(3), order, frame, np.zeros(3), tuple(curves))


def _track(
    node: EulerNode, tolerance: float = TOLERANCE, keys: KeyPlacement = KeyPlacement.AUTO, path: str = "rotation"
) -> Track:
    clip = from_euler(EulerMotion((node,)), tolerance=tolerance, keys=keys).clip
    return next(track for track in clip.tracks if track.path == path)


def _straight(*degrees: tuple[float, float]) -> list[Curve]:
    return [linear(np.array((0.0, 1.0)), np.radians(pair)) for pair in degrees]


def _scipy(order: str, frame: AxesConvention, angles: Floats) -> Floats:
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    q: Floats = rotation.from_euler(order if frame == AxesConvention.INTRINSIC else order.lower(), angles).as_quat()
    return q


def _error(track: Track, node: EulerNode, at: Floats, *, before: bool = False) -> Floats:
    angles = np.stack([evaluate(c or constant(0), at, before=before) for c in node.rotation], axis=-1)
    return quaternion.angle_between(sample(track, at), _scipy(node.order, node.frame, angles))


def _random_curves(seed: int) -> list[Curve]:
    """Three curves with keys of their own: random, lock-grazing and multi-turn, straight and cubic."""
    random = np.random.default_rng(seed)
    curves = []
    for _ in range(3):
        count = int(random.integers(2, 7))
        times = np.sort(random.choice(np.arange(0, 512) / 128, count, replace=False))
        values = random.uniform(-np.pi, np.pi, count) * random.choice([1, 1, 6], count)
        values[random.random(count) < 0.3] = np.pi / 2 + random.choice([0, 1e-9, 1e-3])
        modes = random.choice([Mode.LINEAR, Mode.CUBIC], count).astype(np.uint8)
        curves.append(Curve(TimeAxis(times), values, modes, random.normal(size=count), random.normal(size=count)))
    return curves


@pytest.mark.parametrize(("order", "frame"), CONVENTIONS)
@pytest.mark.parametrize("seed", range(3))
def test_slerp_follows_the_euler_motion(order: str, frame: AxesConvention, seed: int) -> None:
    node = _node(_random_curves(seed), order, frame)
    track = _track(node)
    assert _error(track, node, track.times).max() < 1e-9
    assert _error(track, node, np.linspace(0, 4, 20_011)).max() < TOLERANCE
    keys = np.unique(np.concatenate([curve.times for curve in node.rotation if curve is not None]))
    assert np.isin(keys, track.times).all()
    assert (quaternion.dot(track.values[1:], track.values[:-1]) >= 0).all()
    assert quaternion.angle_between(track.values[1:], track.values[:-1]).max() <= WIDEST


def test_a_quarter_about_two_axes_takes_17_keys_at_most() -> None:
    node = _node(_straight((0, 90), (0, 90), (0, 0)))
    ends = Track(
        0, "rotation", Interpolation.LINEAR, np.array((0.0, 1.0)), evaluate_rotation(node, np.array((0.0, 1.0)))
    )
    at = np.linspace(0, 1, 4001)
    assert np.degrees(_error(ends, node, at).max()) == pytest.approx(19.47, abs=0.05)
    track = _track(node, np.radians(0.1))
    assert len(track.times) <= 17
    assert np.degrees(_error(track, node, at).max()) < 0.1


@pytest.mark.parametrize("turns", [1, 2, 25])
def test_a_spin_keeps_its_turns(turns: int) -> None:
    node = _node(_straight((0, 360 * turns), (0, 0), (0, 0)))
    track = _track(node)
    steps = quaternion.multiply(quaternion.conjugate(track.values[:-1]), track.values[1:])
    assert quaternion.rotation_vector(steps)[:, 0].sum() == pytest.approx(2 * np.pi * turns)
    assert len(track.times) == 3 * turns + 1


def test_turns_without_end_are_refused() -> None:
    with pytest.raises(UnsupportedError, match="keys are needed"):
        _track(_node(_straight((0, 1e12), (0, 0), (0, 0))))


def test_axes_with_keys_of_their_own_are_each_evaluated() -> None:
    """Y has no key at 1 s; a quaternion between mismatched keys would be wrong there."""
    x = linear(np.array((0.0, 1.0, 2.0)), np.array((0.0, 1.0, 0.0)))
    y = linear(np.array((0.5, 2.0)), np.array((0.2, 0.8)))
    track = _track(_node([x, y, None]))
    for t in (0.0, 0.5, 1.0, 2.0):
        angles = np.array((np.interp(t, x.times, x.values), np.interp(t, y.times, y.values), 0))
        expected = _scipy("XYZ", AxesConvention.INTRINSIC, angles)
        np.testing.assert_allclose(quaternion.angle_between(track.values[track.times == t][0], expected), 0, atol=1e-9)


def test_steps_stay_steps() -> None:
    step = Curve(TimeAxis((0.0, 0.5, 1.0)), np.radians((0, 90, 30)), uniform_modes(3, Mode.STEP))
    track = _track(_node([step, None, None]))
    assert track.interpolation is Interpolation.STEP
    np.testing.assert_array_equal(track.times, (0, 0.5, 1))


def test_a_step_beside_a_line_jumps_within_a_float32() -> None:
    step = Curve(TimeAxis((0.0, 0.5, 1.0)), np.radians((0, 90, 30)), uniform_modes(3, Mode.STEP))
    node = _node([step, linear(np.array((0.0, 1.0)), np.radians((0.0, 60.0))), None])
    track = _track(node)
    at = np.linspace(0, 0.9999, 5000)
    assert _error(track, node, at).max() < TOLERANCE
    k = int(np.flatnonzero(track.times == 0.5)[0])
    assert track.times[k - 1] == np.nextafter(np.float32(0.5), np.float32(0))


def test_recordings_keep_their_grid_and_wrap() -> None:
    """170°, 190° as −170°: twenty degrees on, not 340° back."""
    times = np.arange(30) / 30
    turning = (np.arange(30) * 20.0 + 180) % 360 - 180
    node = _node([linear(times, np.radians(turning)), None, None])
    track = _track(node)
    assert len(track.times) == 30
    assert quaternion.angle_between(track.values[1:], track.values[:-1]).max() == pytest.approx(np.radians(20))
    assert (quaternion.dot(track.values[1:], track.values[:-1]) > 0).all()
    assert len(_track(node, keys=KeyPlacement.ADAPTIVE).times) > 30


def test_few_even_keys_are_no_recording() -> None:
    """A key a second is set by somebody: between them the angles are to be followed."""
    angles = np.radians([[0, 90, 0, -90, 0], [0, 90, 180, 90, 0]])
    track = _track(_node([*(linear(np.arange(5.0), each) for each in angles), None]))
    assert len(track.times) > 5


def test_keys_that_fall_together_in_float32_are_one() -> None:
    times = np.array((0.0, 1.0, 1.0 + 1e-9, 2.0))
    track = _track(_node([linear(times, np.array((0.0, 0.1, 0.2, 0.2))), None, None]), keys=KeyPlacement.GRID)
    assert track.times.tolist() == [0, 1, 2]
    assert quaternion.rotation_vector(track.values)[1, 0] == pytest.approx(0.2)


def test_a_cubic_that_comes_back_moves_all_the_same() -> None:
    """Equal values, but tangents that lead away: 0.75 m / 4 at 0.5 s."""
    keys = np.array((0.0, 1.0))
    swing = Curve(TimeAxis(keys), np.zeros(2), uniform_modes(2, Mode.CUBIC), np.array((0, -0.75)), np.array((0.75, 0)))
    assert not swing.is_constant
    track = _track(_node([swing, None, None]))
    assert quaternion.rotation_vector(sample(track, np.array([0.5])))[0, 0] == pytest.approx(0.75 / 4, abs=TOLERANCE)


def test_pre_and_post_rotation_and_pivots_are_fbxs() -> None:
    """Against the product of 4 × 4 matrices, as Autodesk writes it."""
    random = np.random.default_rng(7)
    pre, post = (quaternion.normalize(random.normal(size=4)) for _ in range(2))
    offsets = {name: random.normal(size=3) for name in OFFSETS}
    curves = tuple(_straight((0, 300), (0, 90), (20, 0)))
    start, size, pivots = random.normal(size=3), np.array((1.0, 2.0, 0.5)), Pivots(pre, post, **offsets)
    node = EulerNode("a", -1, start, "XYZ", AxesConvention.EXTRINSIC, np.zeros(3), curves, scale=size, pivots=pivots)
    converted = from_euler(EulerMotion((node,)), tolerance=1e-4)
    turn, place = converted.clip.tracks[1], converted.clip.tracks[0]
    for t in np.linspace(0, 1, 57):
        angles = [float(evaluate(c or constant(0), np.array(t))) for c in node.rotation]
        r = _scipy("XYZ", AxesConvention.EXTRINSIC, np.array(angles))
        chain = (
            *(_moved(by) for by in (start, offsets["rotation_offset"], offsets["rotation_pivot"])),
            *(_turned(by) for by in (pre, r, quaternion.conjugate(post))),
            *(_moved(by) for by in (-offsets["rotation_pivot"], offsets["scaling_offset"], offsets["scaling_pivot"])),
            np.diag([*size, 1.0]),
            _moved(-offsets["scaling_pivot"]),
        )
        expected = np.linalg.multi_dot(chain)
        at = np.array([t])
        found = _moved(sample(place, at)[0]) @ _turned(sample(turn, at)[0]) @ np.diag([*node.scale, 1.0])
        np.testing.assert_allclose(found, expected, atol=2e-3)
        exact = (
            _moved(evaluate_translation(node, at)[0])
            @ _turned(evaluate_rotation(node, at)[0])
            @ np.diag([*node.scale, 1.0])
        )
        np.testing.assert_allclose(exact, expected, atol=1e-12)


def test_a_cubic_translation_is_followed() -> None:
    cubic = Curve(
        TimeAxis((0.0, 1.0)), np.array((0.0, 1.0)), uniform_modes(2, Mode.CUBIC), np.zeros(2), np.array((4.0, 0))
    )
    node = EulerNode("a", -1, np.zeros(3), "XYZ", AxesConvention.INTRINSIC, np.zeros(3), (None,) * 3, {1: cubic})
    track = _track(node, 1e-3, path="translation")
    at = np.linspace(0, 1, 1000)
    np.testing.assert_allclose(sample(track, at)[:, 1], evaluate(cubic, at), atol=1e-3)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf, 1e-9, 50.0])
def test_a_tolerance_out_of_range_is_refused(tolerance: float) -> None:
    with pytest.raises(RangeError, match="`tolerance` is"):
        from_euler(EulerMotion(()), tolerance=tolerance)


def test_lock_is_no_obstacle() -> None:
    """Through lock the quaternions are those of the angles; only the angles are strained."""
    node = _node(_straight((0, 40), (80, 100), (0, -30)))
    assert _error(_track(node), node, np.linspace(0, 1, 999)).max() < TOLERANCE
    assert euler.gimbal_distance(_track(node).values, order="XYZ").min() < 0.01


def _moved(by: Floats) -> Floats:
    matrix: Floats = np.eye(4)
    matrix[:3, 3] = by
    return matrix


def _turned(q: Floats) -> Floats:
    matrix: Floats = np.eye(4)
    matrix[:3, :3] = quaternion.to_matrix(q)
    return matrix


def test_the_limit_of_keys_is_that_of_all_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """What nodes before it had left was named as the limit, down to 0."""
    monkeypatch.setattr(conversion, "MIN_KEY_LIMIT", 40)
    monkeypatch.setattr(conversion, "KEYS_PER_SOURCE_KEY", 1)
    monkeypatch.setattr(conversion, "divide_nodes", lambda nodes: [range(i, i + 1) for i in range(len(nodes))])
    nodes = tuple(_node(_straight((0, end), (0, 90), (0, 0))) for end in (90.0, 91.0, 92.0))
    with pytest.raises(UnsupportedError, match="node 'a': the motion up to here needs over 40 keys") as error:
        from_euler(EulerMotion(nodes), tolerance=TOLERANCE)
    assert error.value.help.endswith("adds none")
