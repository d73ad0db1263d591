"""Last frames that are missing or duplicate: like the analysis of `loop`, without the motion inside of a clip."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.end_frames import EndFrame, EndFrameKind, find_end_frames
from anim.measure.loops.loop_analysis import analyze_loop
from anim.measure.loops.loop_kind import LoopKind
from anim.measure.loops.seam import measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Scene
from tests.anim.skinning.scenes import random_scene
from tests.clips import STEP, about, clip, skeleton, track

FPS = 10
CIRCLE = np.linspace(0, 2 * np.pi, 11)
CLOSED = np.stack((np.sin(CIRCLE), 1 - np.cos(CIRCLE), 0 * CIRCLE), axis=1)
CLOSED[-1] = CLOSED[0]


def end_frame(skin: SkinMotion, moving: Clip) -> EndFrame | None:
    (seam,) = measure_seams(skin, [LoopRange(moving, moving.start, moving.end)])
    (found,) = find_end_frames(skin, [moving], [-1], [seam.gap])
    return found


def kind_of(values: Floats, speed: float = 1.0) -> EndFrameKind | None:
    skin = SkinMotion(Scene(skeleton([-1, 0, 1], translation=[[0, 0, 0], [0, 1, 0], [0, 1, 0]]), ()))
    moving = clip(track("translation", np.arange(len(values)) / FPS / speed, values, node=1))
    found = end_frame(skin, moving)
    return None if found is None else found.kind


def test_a_frame_that_is_missing_or_duplicate() -> None:
    assert kind_of(CLOSED) is None
    assert kind_of(CLOSED[:-1]) is EndFrameKind.MISSING
    assert kind_of(np.vstack((CLOSED, CLOSED[-1:]))) is EndFrameKind.DUPLICATE


def test_a_key_between_frames_does_not_hide_a_missing_frame() -> None:
    """Of a track that shows and hides something."""
    shown = track("scale", np.array([0, 0.13]), [[1.0, 1, 1], [0.0, 0, 0]], STEP, node=2)
    moving = track("translation", np.arange(10) / FPS, CLOSED[:-1], node=1)
    skin = SkinMotion(Scene(skeleton([-1, 0, 1], translation=[[0, 0, 0], [0, 1, 0], [0, 1, 0]]), ()))
    found = end_frame(skin, clip(moving, shown))
    assert found is not None
    assert (found.kind, found.duration) == (EndFrameKind.MISSING, 1 / FPS)


def test_authored_pauses_are_no_duplicate_frame() -> None:
    last = CLOSED[-1:]
    assert kind_of(np.vstack((CLOSED, last, last))) is None  # of two frames
    assert kind_of(np.vstack((last, CLOSED, last))) is None  # also at the start
    assert kind_of(np.vstack((CLOSED, last)), speed=0.5) is None  # of 0.2 s
    assert kind_of(np.zeros((6, 3))) is None


@pytest.mark.parametrize("seed", range(8))
def test_the_kind_is_that_of_the_analysis(seed: int) -> None:
    random = np.random.default_rng(seed)
    scene = random_scene(seed)
    skin = SkinMotion(scene)
    end = FPS + 1 if seed % 4 else FPS  # with the last frame, for the first `seed` nodes
    tracks = [
        track("rotation", np.arange(n) / FPS, about("xyz"[i % 3], 30 * random.random() * CLOSED[:n, 0]), node=i)
        for i in range(len(scene.skeleton))
        for n in (end if i < seed else FPS,)
    ]
    moving = clip(*tracks)
    found = end_frame(skin, moving)
    is_open = analyze_loop(skin, moving).kind is LoopKind.OPEN_BY_ONE_FRAME
    assert is_open == (found is not None and found.kind is EndFrameKind.MISSING)
    assert is_open or seed % 4


def test_open_clips_are_not_sampled_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """That took a minute for 150 clips of 30 000 vertices."""

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError

    for name in ("steps", "velocity_changes"):
        monkeypatch.setattr(SkinMotion, name, refuse)
    assert kind_of(CLOSED[:-1]) is EndFrameKind.MISSING
    assert kind_of(CLOSED[:6]) is None
