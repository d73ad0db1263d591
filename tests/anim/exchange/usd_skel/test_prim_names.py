"""Names of prims keep what identifiers of USD can have."""

from __future__ import annotations

import pytest

from anim.exchange.usd_skel.prim_names import PrimNames, UniqueNames, valid

pytest.importorskip("pxr", reason="usd-core is not installed")


@pytest.mark.parametrize(
    ("name", "expected"),
    [("hip", "hip"), ("left arm", "left_arm"), ("2H_Sword", "_2H_Sword"), ("1", "_1"), ("", "_"), ("_x", "_x")],
)
def test_valid_names(name: str, expected: str) -> None:
    assert valid(name) == expected


def test_weapons_for_one_hand_and_for_two() -> None:
    names = PrimNames()
    assert [names.child("/root", each) for each in ("1H_Sword", "2H_Sword", "1H_Sword")] == [
        "/root/_1H_Sword",
        "/root/_2H_Sword",
        "/root/_1H_Sword_2",
    ]


def test_names_of_many_equal_ones_go_on_from_the_last() -> None:
    names = UniqueNames(["arm_3"])
    assert [names.add("arm") for _ in range(4)] == ["arm", "arm_2", "arm_4", "arm_5"]
    assert names.add("arm_2") == "arm_2_2"
