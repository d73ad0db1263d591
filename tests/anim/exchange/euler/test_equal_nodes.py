"""Nodes with equal curves: converted once, with the result of each alone."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.exchange.euler import from_euler as conversion
from anim.exchange.euler import gimbal
from anim.exchange.euler.convention import UNSPECIFIED
from anim.exchange.euler.curve import constant, linear
from anim.exchange.euler.equal_nodes import first_equal_nodes
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.gimbal import gimbal_stats
from anim.exchange.euler.motion import EulerMotion, EulerNode, Pivots
from anim.exchange.euler.stacked_tracks import fit_nodes
from anim.exchange.formats import json_reader
from anim.maths.euler import AxesConvention
from tests import many
from tests.calls import count_calls

TIMES = np.array([0.0, 0.5, 1.0])


def _node(name: str, degrees: float = 50.0, **parts: object) -> EulerNode:
    swing = linear(TIMES, np.radians([0.0, degrees, 10.0]))
    node = EulerNode(name, -1, np.zeros(3), "XYZ", AxesConvention.INTRINSIC, np.zeros(3), (swing, None, swing))
    return replace(node, **{"moves": {1: linear(TIMES, np.array([0.0, 1.0, 0.0]))}, **parts})  # type: ignore[arg-type]


def test_nodes_are_equal_whatever_their_names_and_parents() -> None:
    other_rest = _node("f", angles=np.array([0.0, 0.1, 0.0]))
    nodes = [
        _node("a"),
        _node("b", 51),
        _node("c", parent=1),
        _node("d", order="ZYX"),
        _node("e", frame=AxesConvention.EXTRINSIC),
        other_rest,
        _node("g", moves={2: _node("a").moves[1]}),
        _node("h", pivots=Pivots(scaling_pivot=np.ones(3))),
        _node("i", pivots=Pivots(scaling_pivot=np.ones(3))),
        _node("j", scales={0: constant(2.0)}),
        _node("k", 51, end=True),
    ]
    assert first_equal_nodes(nodes) == [0, 1, 0, 3, 4, 5, 6, 7, 7, 9, 1]


def test_equal_nodes_are_converted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("a", "b", "c", "d")
    nodes = tuple(_node(name, degrees) for name, degrees in zip(names, (50, 60, 50, 60), strict=True))
    nodes = (*nodes[:3], replace(nodes[3], parent=0, translation=np.array([0.0, 2.0, 0.0])))
    sizes: list[int] = []

    def counted(some: dict[int, EulerNode], *more: Any, **options: Any) -> Any:
        sizes.append(len(some))
        return fit_nodes(some, *more, **options)

    monkeypatch.setattr(conversion, "fit_nodes", counted)
    motion = EulerMotion(nodes)
    clip = from_euler(motion, tolerance=1e-3).clip
    assert sum(sizes) == 3  # the fourth has another rest pose
    nearest = count_calls(monkeypatch, gimbal, "_near_times")
    rows = gimbal_stats(motion, clip)
    assert len(nearest) == 1
    assert [row.node for row in rows] == list(names)
    for number, node in enumerate(nodes):
        alone = EulerMotion((replace(node, parent=-1),))
        expected = from_euler(alone, tolerance=1e-3).clip
        found = [track for track in clip.tracks if track.node == number]
        assert [track.path for track in found] == [track.path for track in expected.tracks]
        for one, other in zip(found, expected.tracks, strict=True):
            assert np.array_equal(one.times, other.times)
            assert np.array_equal(one.values, other.values)
        assert rows[number] == gimbal_stats(alone, expected)[0]


def test_curves_of_the_same_text_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = count_calls(monkeypatch, json_reader, "_curve")
    motion = json_reader.read(many.json_curves(50), UNSPECIFIED)
    assert (len(motion.nodes), len(counted)) == (50, 1)


def test_true_is_no_number_beside_a_curve_of_ones() -> None:
    content = json.loads(many.json_curves(2))
    content["nodes"][1]["curves"] = {"rotation.x": {"times": [0, 1], "values": [0, True]}}
    with pytest.raises(Exception, match="values is not a list of 2 numbers"):
        json_reader.read(json.dumps(content).encode(), UNSPECIFIED)
