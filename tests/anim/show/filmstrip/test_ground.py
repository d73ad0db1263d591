"""The ground of a filmstrip: under the feet, whatever hangs lower."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from anim.model.vertex_cache import VertexCache, from_arrays
from anim.show.filmstrip import clips
from anim.show.filmstrip.frame_selection import FrameSelection
from anim.show.filmstrip.ground import ground_height
from tests.files import mark_slow, opened_path

# A foot, a head and the tip of a sword that is held level at rest and points at the ground later.
REST = np.array([[0, 0, 0], [0, 1.8, 0], [0.9, 1, 0.0]])
FACE = np.array([[0, 1, 2]])


def _cache(*frames: list[list[float]], rest: bool = True) -> VertexCache:
    times = np.arange(len(frames), dtype=float)
    return from_arrays(times, np.array(frames, np.float32), FACE, rest=REST if rest else None)


def _raised(height: float) -> list[list[float]]:
    return [[x, y + height, z] for x, y, z in REST.tolist()]


def test_a_sword_below_the_feet_has_no_ground() -> None:
    lifted = [[0, 0.3, 0], [0, 2.1, 0], [0.3, -0.4, 0.0]]
    assert ground_height(_cache(lifted)) == pytest.approx(0.3)


@pytest.mark.parametrize(("lowest", "ground"), [(0.05, 0.0), (-0.05, 0.0), (0.5, 0.5), (-0.5, -0.5)])
def test_feet_that_hardly_lift_or_sink_stand_on_the_floor_of_the_scene(lowest: float, ground: float) -> None:
    frames = [_raised(lowest + lift) for lift in (0.0, 0.2)]
    assert ground_height(_cache(*frames)) == pytest.approx(ground)


def test_only_what_a_skin_moves_can_be_a_foot() -> None:
    body = np.array([False, True, True])
    frame = _raised(3)
    assert ground_height(_cache(frame), body) == pytest.approx(4)


def test_a_cache_without_a_rest_pose_begins_with_its_first_frame() -> None:
    pointing = [[0, 0.6, 0], [0, 2.4, 0], [0.3, -0.4, 0.0]]
    assert ground_height(_cache(_raised(0.6), pointing, rest=False)) == pytest.approx(0.6)


@pytest.mark.parametrize(
    "clip", mark_slow(["Death_A", "Lie_Idle", "Sit_Floor_Idle", "Running_A"], slow=["Lie_Idle", "Sit_Floor_Idle"])
)
def test_knight_stands_at_0_while_its_weapons_are_lower(asset: Callable[[str], Path], clip: str) -> None:
    document = opened_path(asset("Knight.glb"))
    number = [each["name"] for each in document.json["animations"]].index(clip)
    _, extent = clips.build_strips(clips.of_document(document, [number], (), FrameSelection(count=3)))
    assert extent.ground == 0
    if clip != "Running_A":
        assert extent.points[:, 1].min() < -0.2
