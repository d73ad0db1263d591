"""Many nodes converted in one pass, against each node by itself: equal to the bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.curves.fitting import stacked_keys as fitting
from anim.exchange.euler import from_euler as conversion
from anim.exchange.euler.baked_keys import Float32Times, KeyPlacement
from anim.exchange.euler.curve import Curve, Mode
from anim.exchange.euler.from_euler import fit_node, from_euler
from anim.exchange.euler.gimbal import gimbal_stats
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode, Pivots
from anim.exchange.euler.node_stack import PATHS, path_curves
from anim.exchange.euler.stacked_tracks import BLOCK_KEYS, NodeKeys, divide_nodes, fit_nodes
from anim.maths import euler
from anim.maths.euler import AxesConvention
from anim.model import TimeAxis

UNITS = {"translation": 0.5, "rotation": 1.0, "scale": 1.0}
CLOSE_S = 1e-9  # s; keys that are one in float32


def _curve(chance: np.random.Generator, size: float) -> Curve:
    """One to six keys of any mode, now and then two of them at the same float32 time, or all values equal."""
    count = int(chance.integers(1, 7))
    steps = chance.choice([CLOSE_S, 0.1, 0.3, 0.7], count, p=[0.1, 0.3, 0.3, 0.3])
    values = chance.uniform(-size, size, count) * (chance.random() < 0.8)
    if chance.random() < 0.3:
        return Curve(TimeAxis(np.cumsum(steps)), values, np.full(count, chance.integers(2), np.uint8))
    handles = [chance.uniform(-size, size, count) for _ in range(2)] + [chance.uniform(0, 1, count) for _ in range(2)]
    weights = [handle if chance.random() < 0.3 else None for handle in handles[2:]]
    return Curve(
        TimeAxis(np.cumsum(steps)), values, chance.integers(0, 3, count).astype(np.uint8), *handles[:2], *weights
    )


def _node(chance: np.random.Generator, number: int) -> EulerNode:
    order = str(chance.choice(["XYZ", "ZXY", "ZXZ", "YZ", ""]))
    frame = AxesConvention.INTRINSIC if chance.random() < 0.5 else AxesConvention.EXTRINSIC
    pivots = Pivots(
        pre_rotation=euler.to_quaternion(chance.uniform(-1, 1, 1), order="X"),
        rotation_pivot=chance.standard_normal(3),
        scaling_pivot=chance.standard_normal(3),
    )
    rotation = tuple(_curve(chance, 4.0) if chance.random() < 0.6 else None for _ in order)
    moves, scales = ({axis: _curve(chance, 1.0) for axis in range(3) if chance.random() < 0.3} for _ in range(2))
    rest = chance.standard_normal(3), order, frame, chance.uniform(-2, 2, len(order)), rotation, moves
    return EulerNode(f"n{number}", -1, *rest, scales=scales, pivots=pivots if chance.random() < 0.2 else NO_PIVOTS)


def _motion(seed: int, count: int = 12) -> EulerMotion:
    chance = np.random.default_rng(seed)
    return EulerMotion(tuple(_node(chance, number) for number in range(count)))


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from((0.05, 0.005)))
def test_nodes_together_have_the_keys_of_each_node_alone(seed: int, tolerance: float) -> None:
    nodes, stored = dict(enumerate(_motion(seed).nodes)), Float32Times()
    sampled = [number for number in nodes if number % 3 == 0]
    found = fit_nodes(nodes, tolerance, UNITS, sampled=sampled)
    expected = {(number, path) for number, node in nodes.items() for path in PATHS if path_curves(node, path)}
    assert found.keys() == expected
    for (number, path), keys in found.items():
        alone = fit_node(stored.node(nodes[number]), path, None if number in sampled else tolerance * UNITS[path])
        assert keys.interpolation == alone.interpolation
        assert keys.times.tobytes() == alone.times.tobytes()
        assert keys.values.tobytes() == alone.values.tobytes()


def test_long_motions_are_left_to_be_fitted_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same keys: some motions are dropped between two rounds, some before the first."""
    motion = _motion(3, 20)
    whole = from_euler(motion, tolerance=0.002, keys=KeyPlacement.ADAPTIVE)
    counted = []
    alone = conversion.fit_node

    def called(node: EulerNode, path: str, tolerance: float | None, limit: int | None = None) -> NodeKeys:
        counted.append(node.name)
        return alone(node, path, tolerance, limit)

    monkeypatch.setattr(conversion, "fit_node", called)
    monkeypatch.setattr(fitting, "MAX_STACK_KEYS", 100)
    assert from_euler(motion, tolerance=0.002, keys=KeyPlacement.ADAPTIVE).clip == whole.clip
    assert 2 < len(counted) < len(whole.clip.tracks)


def test_the_gimbal_report_of_many_joints_is_that_of_each(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = _motion(5, 30)
    clip = from_euler(motion, tolerance=0.01).clip
    rows = {row.node: row for row in gimbal_stats(motion, clip)}
    assert len(rows) > 10
    assert any(row.near_s for row in rows.values())
    for number, node in enumerate(motion.nodes):
        own = from_euler(EulerMotion((node,)), tolerance=0.01).clip
        tracks = tuple(track for track in clip.tracks if track.node == number)
        assert gimbal_stats(motion, type(own)("", tracks)) == ((rows[node.name],) if node.name in rows else ())


def test_blocks_hold_every_node_once() -> None:
    node = _motion(1, 1).nodes[0]
    long = Curve(TimeAxis(np.arange(1.0, BLOCK_KEYS)), np.ones(BLOCK_KEYS - 1), np.full(BLOCK_KEYS - 1, Mode.LINEAR))
    many = EulerNode("long", -1, np.zeros(3), "X", AxesConvention.INTRINSIC, np.zeros(1), (long,))
    nodes = [node, many, many, many, node]
    assert [list(block) for block in divide_nodes(nodes)] == [[0, 1], [2, 3], [4]]
    assert [list(block) for block in divide_nodes([])] == [[]]
