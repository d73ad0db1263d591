"""Which things of two files are the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.measure.compare.name_matching import (
    match_by_letters,
    match_by_name,
    match_by_name_then_order,
    match_nodes,
)
from anim.model import Mesh, MeshInstance, Scene, Skeleton, Skin
from tests.clips import skeleton

NOTHING = np.empty(0)


def test_by_name_the_first_belongs_to_the_first() -> None:
    assert match_by_name(["a", "b", "a"], ["b", "a"]).tolist() == [1, 0, -1]
    assert match_by_name(["a", "a"], ["x", "a", "a"]).tolist() == [1, 2]
    assert match_by_name(["", "a"], ["", ""]).tolist() == [-1, -1]
    assert match_by_name([], ["a"]).tolist() == []


def test_by_order_only_where_names_say_nothing() -> None:
    assert match_by_name_then_order(["walk", ""], ["run", "walk"]).tolist() == [1, 0]
    assert match_by_name_then_order(["walk", "run"], ["", "walk"]).tolist() == [1, 0]
    assert match_by_name_then_order(["walk", "run"], ["walk", "jump"]).tolist() == [0, -1]
    assert match_by_name_then_order(["a", "b"], ["c", "d"]).tolist() == [0, 1]
    assert match_by_name_then_order(["a", "b", "c"], ["d"]).tolist() == [0, -1, -1]


def test_nodes_by_name_wherever_they_are() -> None:
    old = Scene(_named(["hip", "knee", "foot"], [-1, 0, 1]), ())
    new = Scene(_named(["foot", "extra", "knee", "hip"], [2, -1, 3, 1]), ())
    assert match_nodes(old, new).tolist() == [3, 2, 0]
    assert match_nodes(new, old).tolist() == [2, -1, 1, 0]


def test_nodes_of_repeated_names_by_the_names_above_them() -> None:
    old = Scene(_named(["hip", "foot.L", "foot", "foot"], [-1, 0, 0, 1]), ())
    new = Scene(_named(["foot", "hip", "foot", "foot.L"], [3, -1, 1, 1]), ())
    assert match_nodes(old, new).tolist() == [1, 3, 2, 0]
    moved = Scene(_named(["foot", "hip", "foot", "foot.L"], [1, -1, 1, 1]), ())
    assert match_nodes(old, moved).tolist() == [1, 3, 0, 2]


def test_by_letters_where_a_tool_replaced_other_characters() -> None:
    assert match_by_letters(["hip", "Foot.L", "Foot.R"], ["Foot_R", "FootL", "hip"]).tolist() == [2, 1, 0]
    assert match_by_letters(["Foot.L", "Foot_L"], ["Foot_L", "FootL"]).tolist() == [1, 0]
    assert match_by_letters(["a.b", "ab"], ["a_b"]).tolist() == [-1, -1]
    assert match_by_letters(["", "."], ["_", ""]).tolist() == [-1, -1]
    assert match_by_letters(["Foot.L", "hip", "Foot.L"], ["Foot_L", "hip", "Foot.L"]).tolist() == [0, 1, 2]
    assert match_by_letters(["a", "a", "b"], ["a", "b"]).tolist() == [0, -1, 1]
    old = Scene(_named(["hip", "Knee.L", "Knee.R"], [-1, 0, 0]), ())
    new = Scene(_named(["hip", "Knee_R", "Knee_L"], [-1, 0, 0]), ())
    assert match_nodes(old, new).tolist() == [0, 2, 1]


def test_joints_without_names_by_their_order_in_the_skin() -> None:
    old = _skinned(_named(["a", "b", "c"], [-1, 0, 1]), [0, 1, 2])
    new = _skinned(_named(["", "", "", ""], [3, 0, 1, -1]), [0, 1, 2])
    assert match_nodes(old, new).tolist() == [0, 1, 2]


def test_children_by_their_order_under_one_parent() -> None:
    """The second of the children is a parent itself, in both; the others follow in order."""
    old = Scene(_named(["root", "", "", "", ""], [-1, 0, 0, 0, 2]), ())
    new = Scene(_named(["", "", "root", "", ""], [2, 2, -1, 0, 2]), ())
    assert match_nodes(old, new).tolist() == [2, 1, 0, 4, 3]


def test_other_names_beside_known_ones_are_other_nodes() -> None:
    old = Scene(_named(["root", "left"], [-1, 0]), ())
    new = Scene(_named(["root", "right"], [-1, 0]), ())
    assert match_nodes(old, new).tolist() == [0, -1]
    strangers = Scene(_named(["armature", "arm"], [-1, 0]), ())
    assert match_nodes(old, strangers).tolist() == [0, 1]  # nothing has the same name: order is all there is


def _named(names: list[str], parents: list[int]) -> Skeleton:
    return replace(skeleton(parents), names=tuple(names))


def _skinned(nodes: Skeleton, joints: list[int]) -> Scene:
    skin = Skin(np.array(joints), np.tile(np.eye(4)[:3], (len(joints), 1, 1)))
    none = np.empty((1, 0))
    points = np.zeros((1, 3))
    mesh = Mesh("", points, np.empty((0, 3), np.int64), none.astype(np.int64), none, np.empty((0, 1, 3)), NOTHING)
    return Scene(nodes, (MeshInstance(0, mesh, skin, NOTHING),))
