"""A character mirrored as a whole has the motion of its own figure, mirrored with it."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler.from_euler import ImportedMotion
from anim.exchange.retarget.apply import apply_to_character
from anim.model import Clip, Scene, Skeleton
from anim.sampling import sample_pose
from tests.clips import about, clip, skeleton, track

OFFSETS = np.array(((0.0, 1, 0), (0.3, 0.4, 0.1), (0.5, 0, 0), (0, 0.3, 0.2), (-0.4, 0.1, 0)))
PARENTS = [-1, 0, 1, 0, 0]
TIMES = np.linspace(0, 1, 9)


def _motion() -> Clip:
    arm = track("rotation", [0, 1], about("z", [0, 70]), node=1)
    elbow = track("rotation", [0, 1], about("y", [0, -50]), node=2)
    path = track("translation", [0, 1], np.array([[0.0, 1, 0], [0.2, 1.1, 0.5]]), node=0)
    return clip(path, arm, elbow)


def _below(scale: tuple[float, float, float] | Floats, rotation: Floats, offsets: Floats = OFFSETS) -> Skeleton:
    """The figure below a node of a scale and a rotation; its nodes are one later."""
    names = ("wrap", *map(str, range(5)))
    parents = [-1, *(parent + 1 for parent in PARENTS)]
    rotations = np.tile((0.0, 0, 0, 1), (6, 1))
    rotations[0] = rotation
    scales = np.ones((6, 3))
    scales[0] = scale
    return Skeleton(names, np.array(parents), np.concatenate(([[0.3, 0, -2]], offsets)), rotations, scales)


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, 1, -1), (2, -2, 2), (-1, -1, -1), (1, 1, 1), (-1, 1, -1)])
@pytest.mark.parametrize("angle", [0.0, 40.0])
def test_a_mirrored_figure_keeps_the_local_motion(scale: tuple[float, float, float], angle: float) -> None:
    figure = skeleton(PARENTS, translation=OFFSETS)
    motion = _motion()
    target = _below(scale, about("y", [angle])[0])
    done = apply_to_character(
        ImportedMotion(figure, motion, frozenset(), 1e-4), Scene(target, ()), aliases={}, nested=True
    )
    expected, found = sample_pose(figure, motion, TIMES), sample_pose(target, done.clip, TIMES)
    dots = np.abs((expected.rotation * found.rotation[:, 1:]).sum(axis=-1))
    np.testing.assert_allclose(dots, 1.0, atol=1e-6)
    np.testing.assert_allclose(found.translation[:, 1:], expected.translation, atol=1e-5)


@pytest.mark.parametrize(("scale", "angle"), [((-1, 1, 1), 0.0), ((-2, 2, 2), 0.0), ((-1, -1, -1), 180.0)])
def test_a_mirrored_figure_of_another_build_moves_as_if_it_were_not(
    scale: tuple[float, float, float], angle: float
) -> None:
    source = ImportedMotion(skeleton(PARENTS, translation=OFFSETS), _motion(), frozenset(), 1e-4)
    other = OFFSETS * np.array([1.1, 0.9, 1.3, 1.2, 0.8])[:, None] + np.array((0.01, 0.02, -0.03))
    size = abs(scale[0])
    targets = [_below(size * np.ones(3), about("x", [0])[0], other), _below(scale, about("x", [angle])[0], other)]
    clips = [apply_to_character(source, Scene(each, ()), aliases={}, nested=True).clip for each in targets]
    expected, found = (sample_pose(each, moved, TIMES) for each, moved in zip(targets, clips, strict=True))
    dots = np.abs((expected.rotation * found.rotation).sum(axis=-1))
    np.testing.assert_allclose(dots[:, 1:], 1.0, atol=1e-6)
    np.testing.assert_allclose(found.translation[:, 1:], expected.translation[:, 1:], atol=1e-5)


@pytest.mark.parametrize("build", [1.0, np.array([1.1, 0.9, 1.3, 1.2, 0.8])[:, None]])
@pytest.mark.parametrize(("scale", "heading"), [((-1, 1, 1), 0.0), ((1, 1, -1), 180.0), ((-2, 2, 2), 0.0)])
def test_a_flat_mirrored_figure_moves_as_if_it_were_not(
    scale: tuple[float, float, float], heading: float, build: float | Floats
) -> None:
    """Turned by half a turn, it fits without a reflection too: rounding decided which of the two was taken."""
    flat = OFFSETS * (1, 1, 0)
    source = ImportedMotion(skeleton(PARENTS, translation=flat), _motion(), frozenset(), 1e-4)
    turned = _below(abs(scale[0]) * np.ones(3), about("y", [heading])[0], flat * build)
    targets = [turned, _below(scale, about("y", [0])[0], flat * build)]
    clips = [apply_to_character(source, Scene(each, ()), aliases={}, nested=True).clip for each in targets]
    expected, found = (sample_pose(each, moved, TIMES) for each, moved in zip(targets, clips, strict=True))
    dots = np.abs((expected.rotation * found.rotation).sum(axis=-1))
    np.testing.assert_allclose(dots[:, 1:], 1.0, atol=1e-6)
    np.testing.assert_allclose(found.translation[:, 1:], expected.translation[:, 1:], atol=1e-5)
