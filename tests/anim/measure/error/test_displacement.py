"""The search for the longest vector: right with any amount of searching, and never too short."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.maths import quaternion
from anim.measure.error.displacement import BoundGroups, DisplacementRate, SkinnedDisplacement
from anim.measure.error.max_displacement import lengths, lengths_by_group, max_displacement

RNG = np.random.default_rng(5)
JOINTS, FRAMES, VERTICES = 4, 40, 30


@pytest.fixture
def field() -> SkinnedDisplacement:
    """Three groups of vertices in random places, carried by one or two of four joints that move at random."""
    points = RNG.normal(size=(VERTICES, 3))
    low, high = points.min(axis=0), points.max(axis=0)
    sides = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    corners = np.tile(low + sides * (high - low), (JOINTS, 1, 1))
    whole = np.column_stack((points, np.ones(VERTICES)))
    two = np.concatenate((0.25 * whole[20:], 0.75 * whole[20:]), axis=1)
    groups = BoundGroups([np.array([0]), np.array([1]), np.array([2, 3])], [whole[:10], whole[10:20], two], corners)
    return SkinnedDisplacement(groups, RNG.normal(size=(JOINTS, FRAMES, 3, 4)))


def _all(field: SkinnedDisplacement | DisplacementRate, frames: int) -> list[Floats]:
    return [lengths(field, group, np.arange(frames)) for group in range(3)]


def test_the_longest_is_found_where_it_is(field: SkinnedDisplacement) -> None:
    every = _all(field, FRAMES)
    top = max(each.max() for each in every)
    found = max_displacement(field, floor=0, slack=1, most=10**9)
    assert found.length == top
    assert every[found.group][found.vertex, found.frame] == top


@pytest.mark.parametrize("most", [0, 1, 50, 500])
def test_less_searching_says_more_never_less(field: SkinnedDisplacement, most: int) -> None:
    top = max(each.max() for each in _all(field, FRAMES))
    found = max_displacement(field, floor=0, slack=1, most=most)
    assert top <= found.length <= field.limits.max()
    if not most:
        assert (found.length, found.vertex) == (field.limits.max(), -1)


def test_what_is_below_the_floor_is_only_bounded(field: SkinnedDisplacement) -> None:
    found = max_displacement(field, floor=1e9, slack=1, most=10**9)
    assert (found.length, found.vertex) == (field.limits.max(), -1)


def test_limits_are_limits(field: SkinnedDisplacement) -> None:
    step = np.full(FRAMES - 1, 0.1)
    for one, frames in ((field, FRAMES), (field.rate(step), FRAMES - 1), (DisplacementRate(field, step), FRAMES - 1)):
        for group, sizes in enumerate(_all(one, frames)):  # type: ignore[arg-type]
            assert (sizes <= one.limits[group] * (1 + 1e-12)).all()


def test_rates_are_differences(field: SkinnedDisplacement) -> None:
    step = RNG.uniform(0.1, 0.2, FRAMES - 1)
    frames = np.array([3, 17, 0])
    for group in range(3):
        vectors = field.vectors(group, np.arange(FRAMES))
        expected = (np.diff(vectors, axis=-1) / step)[..., frames]
        for one in (field.rate(step), DisplacementRate(field, step)):
            assert one.vectors(group, frames) == pytest.approx(expected, abs=1e-9)


def test_the_joint_that_moves_a_vertex_most_is_named(field: SkinnedDisplacement) -> None:
    """A vertex with shares 1/4 and 3/4 of two joints: whichever carries it farther."""
    for frame in range(10):
        single = [
            np.linalg.norm(field._moved[j, frame] @ field._groups.products[2][4].reshape(2, 4)[k])
            for k, j in ((0, 2), (1, 3))
        ]
        assert field.joint(2, frame, 4) == (2, 3)[int(np.argmax(single))]


@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e16])
def test_statistics_have_the_lengths_in_single_precision(field: SkinnedDisplacement, scale: float) -> None:
    """But for lengths whose squares do not fit into float32."""
    scaled = SkinnedDisplacement(field._groups, scale * field._moved)
    found = np.concatenate(lengths_by_group(scaled, 3, np.arange(FRAMES)))
    assert found.dtype == (np.float64 if scale > 1 else np.float32)
    np.testing.assert_allclose(found, np.concatenate([each.ravel() for each in _all(scaled, FRAMES)]), rtol=3e-6)


def test_terms_that_cancel_are_added_in_double_precision() -> None:
    """A model 10 km from the origin that turns about itself."""
    far = np.array([1e4, 0.0, 0.0])
    points = far + RNG.normal(size=(VERTICES, 3))
    angles = np.linspace(0.1, 0.2, FRAMES)
    turns = quaternion.to_matrix(quaternion.from_rotation_vector(np.outer(angles, [0.0, 0.0, 1.0]))) - np.eye(3)
    moved = np.concatenate((turns, -(turns @ far)[..., None]), axis=-1)[None]
    groups = BoundGroups([np.array([0])], [np.column_stack((points, np.ones(VERTICES)))], points[None])
    found = lengths_by_group(SkinnedDisplacement(groups, moved), 1, np.arange(FRAMES))[0].reshape(VERTICES, FRAMES)
    np.testing.assert_allclose(found, np.linalg.norm((points - far) @ turns.swapaxes(1, 2), axis=-1).T, rtol=1e-7)
