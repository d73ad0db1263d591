"""Chains whose joints lie on a straight line: a clip put back on its own is the clip it was, wherever they stand."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler.convention import PartialConvention
from anim.exchange.euler.from_euler import ImportedMotion, from_euler
from anim.exchange.euler.motion import Convention, Unit
from anim.exchange.euler.to_euler import to_euler
from anim.exchange.formats import json_reader
from anim.exchange.retarget.apply import apply_to_character
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.maths.euler import AxesConvention
from anim.model import Clip, Scene, Skeleton
from anim.sampling import sample_pose, world_matrices
from tests.clips import track
from tests.files import opened_fixture

MAX_ERROR_M = 1e-5
TIMES = np.linspace(0, 1, 13)
NO_TURN, ONES = np.array((0.0, 0, 0, 1)), np.ones(3)


def _tail(joints: int, at: Floats, turn: Floats, scale: Floats, step: float) -> Skeleton:
    """Joints in a row, upwards, below a placed root."""
    names = ("root", *(f"tail{i}" for i in range(joints)))
    translation = np.array([at, (0, 0, 0), *[(0, step, 0)] * (joints - 1)])
    rotation = np.array([turn, *[NO_TURN] * joints])
    return Skeleton(names, np.arange(-1, joints), translation, rotation, np.array([scale, *[ONES] * joints]))


def _wave(joints: int) -> Clip:
    """Every joint turns about all axes; the first is carried to and fro, and up and down."""
    phases = 2 * np.pi * TIMES[:, None] + np.arange(3)
    turns = [
        track("rotation", TIMES, quaternion.from_rotation_vector(0.5 * np.sin(phases + i)), node=1 + i)
        for i in range(joints)
    ]
    return Clip("wave", (*turns, track("translation", TIMES, 0.3 * np.sin(phases), node=1)))


def _written(skeleton: Skeleton, clip: Clip) -> ImportedMotion:
    curves = to_euler(skeleton, clip, order="XYZ").motion
    motion = json_reader.read(
        json_reader.write(curves, Convention("XYZ", AxesConvention.INTRINSIC, Unit.DEG)), PartialConvention()
    )
    return from_euler(motion, tolerance=1e-3, name=clip.name)


def _error(skeleton: Skeleton, clip: Clip, found: Clip) -> float:
    """How far a joint is off at most, key times and others: in metres, or by the distance in 10 m beyond that."""
    times = np.union1d(np.linspace(clip.start, clip.end, 301), clip.tracks[0].times)
    one, two = (world_matrices(skeleton, sample_pose(skeleton, each, times))[..., 3] for each in (clip, found))
    return float(np.linalg.norm(one - two, axis=-1).max() / max(1.0, np.abs(one).max() / 10))


PLACED: dict[str, tuple[Floats, Floats, Floats, float]] = {  # at, turn, scale of the root, step
    "as it is": (np.zeros(3), NO_TURN, ONES, 0.25),
    "mirrored": (np.zeros(3), NO_TURN, np.array((-1.0, 1, 1)), 0.25),
    "turned inside out": (np.zeros(3), NO_TURN, -ONES, 0.25),
    "stretched": (np.zeros(3), np.array((0.5, 0.5, 0.5, 0.5)), np.array((2.0, 0.5, 1.5)), 0.25),
    "in centimeters": (np.zeros(3), np.array((-np.sqrt(0.5), 0, 0, np.sqrt(0.5))), 0.01 * ONES, 25.0),
    "20 km away": (np.array((10_000.0, 0, -20_000)), NO_TURN, ONES, 0.25),
}


@pytest.mark.parametrize("placed", PLACED)
@pytest.mark.parametrize("joints", [1, 2, 6])
def test_a_straight_tail_does_the_same(joints: int, placed: str) -> None:
    skeleton = _tail(joints, *PLACED[placed])
    done = apply_to_character(_written(skeleton, _wave(joints)), Scene(skeleton, ()), aliases={}, nested=True)
    assert done.lowered == (0, 0)
    assert _error(skeleton, _wave(joints), done.clip) < MAX_ERROR_M


@pytest.mark.parametrize("name", ["tube", "arm"])
def test_a_straight_fixture_does_the_same(name: str) -> None:
    document = opened_fixture(name)
    scene = reader.scene(document)
    for clip in reader.clips(document):
        done = apply_to_character(_written(scene.skeleton, clip), scene, aliases={}, nested=True)
        assert _error(scene.skeleton, clip, done.clip) < MAX_ERROR_M, clip.name


def test_a_straight_tail_placed_elsewhere_does_the_same() -> None:
    """Moved, twice as large and laid down: the joints' own tracks stay what they were."""
    skeleton = _tail(6, *PLACED["as it is"])
    down = np.array((np.sin(0.6), 0, 0, np.cos(0.6)))
    placed = _tail(6, np.array((5.0, 3, -2)), down, 2 * ONES, 0.25)
    done = apply_to_character(_written(skeleton, _wave(6)), Scene(placed, ()), aliases={}, nested=True)
    assert done.scale == pytest.approx(2)
    assert _error(placed, _wave(6), done.clip) < MAX_ERROR_M
