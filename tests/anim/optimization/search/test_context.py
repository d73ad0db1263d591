"""What all clips of a file are optimized under: who carries vertices, who counts by a shell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.model import Clip, MeshInstance, Scene
from anim.optimization.options import Policy
from anim.optimization.search.context import Context
from tests.anim.optimization.making import setting_of
from tests.anim.skinning.scenes import mesh
from tests.clips import about, clip, skeleton, track

# 0 ─ 1 (a cube) ─ 2 (a socket);  3 ─ 4 (a lamp)
NODES = skeleton([-1, 0, 1, -1, 3], scale=[[2, 2, 2], [1, 1, 1], [1, 1, 1], [1, 1, 1], [1, 1, 1]])
CUBE = replace(mesh([[1.0, 0, 0], [0, 1, 0]], np.zeros((2, 0)), np.zeros((2, 0)), targets=np.ones((1, 2, 3))))
SCENE = Scene(NODES, (MeshInstance(1, CUBE, None, np.zeros(1)),))
MOVING = clip(track("rotation", [0, 1], about("x", [0, 9]), node=1))


def _shells(context: Context) -> set[int]:
    """Nodes that are measured around, by six points each."""
    points = context.points
    return {node for i, node in enumerate(points.nodes.tolist()) if (points.joints[:, 0] == i).sum() == 6}


def test_nodes_that_carry_nothing_are_unseen() -> None:
    assert setting_of(SCENE, [MOVING]).invisible.tolist() == [False, False, True, True, True]


def test_moved_nodes_without_vertices_count_by_shells() -> None:
    assert _shells(setting_of(SCENE, [MOVING])) == {2}  # the socket turns with the cube
    lamp = clip(track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]], node=4))
    assert _shells(setting_of(SCENE, [MOVING, lamp])) == {2, 4}
    face = Clip("", (track("weights", [0, 1], [[0], [1]], node=1),))
    assert _shells(setting_of(SCENE, [face])) == set()


def test_shells_go_with_what_is_dropped() -> None:
    policy = Policy(drop_invisible=True)
    assert _shells(setting_of(SCENE, [MOVING], policy=policy)) == set()
    assert _shells(setting_of(SCENE, [MOVING], policy=replace(policy, keep=frozenset({2})))) == {2}


def test_widening_is_the_largest_scale_to_the_world() -> None:
    context = setting_of(SCENE, [MOVING])
    assert [context.widening(node) for node in (0, 1, 4)] == pytest.approx([2, 2, 1])
    assert [surface.owner for surface in context.surfaces] == [1]


def test_scenes_without_vertices_have_shells_only() -> None:
    context = setting_of(Scene(NODES, ()), [MOVING])
    assert context.invisible.all()
    assert _shells(context) == {1, 2}
