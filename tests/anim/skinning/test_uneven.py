"""Joints that scale unevenly, against plain scale tracks."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.skinning.bake import prepare_bake
from anim.skinning.uneven import uneven_joints
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
    assert uneven_joints(made, played, TIMES) == expected


def test_below_a_parent_that_scales_unevenly_a_joint_shears() -> None:
    played = clip(track("scale", [0], [[1, 1, 3]], node=0), track("rotation", [0, 1], about("x", [0, 45]), node=1))
    assert uneven_joints(prepare_bake(reader.scene(opened_fixture("tube"))), played, TIMES) == (0, 1)
