"""A first frame apart from the motion, against angles by the trace of matrices, and motions that only start fast."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.leading_pose import LeadingPose, find_leading_pose
from anim.exchange.formats import bvh_reader
from anim.maths import quaternion
from anim.model import Clip, Interpolation, TimeAxis, Track
from tests.cli.conftest import Find

FPS = 30.0
WALK = 40 + 25 * np.sin(np.arange(60) / 6)  # degrees: at most 4.2 between frames


def _clip(*degrees: Floats, mode: Interpolation = Interpolation.LINEAR) -> Clip:
    axis = TimeAxis(np.arange(len(degrees[0])) / FPS)
    turns = [np.radians(each)[:, None] * np.array([0.6, 0.0, 0.8]) for each in degrees]
    tracks = [Track(k, "rotation", mode, axis, quaternion.from_rotation_vector(turn)) for k, turn in enumerate(turns)]
    return Clip("a", tuple(tracks))


def _with_pose(degrees: Floats, first: float) -> Floats:
    return np.concatenate(([first], degrees))


def test_a_pose_before_the_motion_is_found_with_its_largest_jump() -> None:
    found = find_leading_pose(
        _clip(_with_pose(WALK, -30), _with_pose(WALK, 0), WALK[:1].repeat(61), _with_pose(WALK, 38))
    )
    assert found is not None
    assert (found.num_joints, found.node) == (2, 0)
    assert found.end == pytest.approx(1 / FPS)
    assert np.degrees(found.angle) == pytest.approx(70)


@pytest.mark.parametrize(
    "degrees",
    [
        WALK,
        np.linspace(0, 600, 60),  # fast, and steady
        np.concatenate(([0.0], np.cumsum(20 * 0.5 ** np.arange(59)))),  # a fast start that slows down
        np.concatenate((WALK[:30], WALK[30:] + 90)),  # a jump elsewhere
        _with_pose(np.concatenate((WALK[:30], WALK[30:] + 90)), 0),  # and at the start: a recording with errors
        _with_pose(WALK, 0)[:6],  # too short to tell
        _with_pose(WALK, 35),
    ],
)
def test_motions_are_no_poses(degrees: Floats) -> None:
    assert find_leading_pose(_clip(degrees, degrees)) is None


def test_one_joint_and_steps_are_no_pose() -> None:
    posed = _with_pose(WALK, 0)
    assert find_leading_pose(_clip(posed, WALK[:1].repeat(61))) is None
    assert find_leading_pose(_clip(posed, posed, mode=Interpolation.STEP)) is None


def test_the_t_pose_of_a_real_recording(asset: Find) -> None:
    motion = bvh_reader.read(asset("bvh/cmu_01_01.bvh").read_bytes())
    made = from_euler(motion, tolerance=1e-3)
    found = find_leading_pose(made.clip)
    matrices = [
        (made.skeleton.names[each.node or 0], quaternion.to_matrix(each.values[:2]))
        for each in made.clip.tracks
        if each.path == "rotation"
    ]
    angles = {
        name: np.degrees(np.arccos((np.trace(pair[0].T @ pair[1]) - 1) / 2))
        for name, pair in matrices
        if len(pair) == 2
    }
    assert isinstance(found, LeadingPose)
    assert made.skeleton.names[found.node] == max(angles, key=lambda name: angles[name]) == "LeftForeArm"
    assert np.degrees(found.angle) == pytest.approx(max(angles.values()))
