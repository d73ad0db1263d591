"""Joints that scale unevenly, against plain scale tracks."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.skinning.bake import prepare_bake
from anim.skinning.uneven import UnevenScale
from tests.clips import about, clip, track
from tests.files import opened_fixture

TIMES = np.linspace(0, 1, 600)


@pytest.mark.parametrize(
    ("scale", "expected"), [([1, 1, 1], ()), ([2, 2, 2], ()), ([1, 1, 1.5], (1,)), ([-1, 1, 1], ())]
)
def test_a_joint_with_another_factor_along_one_axis(scale: list[float], expected: tuple[int, ...]) -> None:
    """A mirror keeps lengths: no stretch."""
    first = np.ones(3) if scale[0] > 0 else np.array(scale)
    played = clip(
        track("scale", [0, 1], np.array([first, scale]), node=1),
        track("rotation", [0, 1], about("x", [0, 90]), node=1),
    )
    made = prepare_bake(reader.scene(opened_fixture("tube")), method="dqs")
    assert UnevenScale(made).joints(played, TIMES) == expected


def test_below_a_parent_that_scales_unevenly_a_joint_shears() -> None:
    played = clip(track("scale", [0], [[1, 1, 3]], node=0), track("rotation", [0, 1], about("x", [0, 45]), node=1))
    assert UnevenScale(prepare_bake(reader.scene(opened_fixture("tube")))).joints(played, TIMES) == (0, 1)


@pytest.mark.parametrize("factor", [1.0, 1.5])
def test_one_frame_says_as_much_as_all_where_every_node_scales_evenly(factor: float) -> None:
    """The key that is uneven lies between frames of even ones, or there is none."""
    keys = np.array([[1, 1, 1], [2, 2, 2 * factor], [1, 1, 1]], float)
    played = clip(track("scale", [0, 0.5, 1], keys, node=1), track("rotation", [0, 1], about("x", [0, 90]), node=1))
    made = prepare_bake(reader.scene(opened_fixture("tube")), method="dqs")
    assert UnevenScale(made).joints(played, TIMES) == (() if factor == 1 else (1,))
