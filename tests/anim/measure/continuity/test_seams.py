"""Continuity at the seam of a loop."""

from __future__ import annotations

import numpy as np
import pytest

from anim.curves.tangents.table import TANGENTS, apply_tangents
from anim.measure.continuity.continuity import ContinuityClass, LoopGap, continuity
from anim.model import Track
from tests import clips
from tests.clips import CUBICSPLINE, STEP


def loop_gap(track: Track, *, end: float) -> LoopGap:
    """The loop gap of a track in a clip from 0 s to `end`."""
    whole = clips.track("scale", [0, end], np.ones((2, 3)), node=1)
    found = continuity(clips.clip(track, whole), clips.skeleton([-1, -1]))[0].seam
    assert found is not None
    return found


def test_seams() -> None:
    t = np.arange(5.0)
    ring = np.stack((np.cos(np.pi / 2 * t), np.sin(np.pi / 2 * t), np.zeros(5)), axis=1)
    ring[-1] = ring[0]
    for rule, grade in (("natural", ContinuityClass.C0), ("periodic", ContinuityClass.C2)):
        keys = apply_tangents(t, ring, TANGENTS[rule])
        track = clips.track("translation", t, keys.values, CUBICSPLINE, tangents=(keys.in_tangents, keys.out_tangents))
        assert loop_gap(track, end=4).grade is grade, rule
    closed = apply_tangents(t, ring, TANGENTS["time-aware"], cyclic=True)
    track = clips.track(
        "translation", t, closed.values, CUBICSPLINE, tangents=(closed.in_tangents, closed.out_tangents)
    )
    assert loop_gap(track, end=4).grade is ContinuityClass.C1
    away = clips.track("translation", range(3), [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    found = loop_gap(away, end=2)
    assert found.grade is ContinuityClass.JUMP
    assert found.value_jump == 2


def test_a_step_track_steps_at_the_seam_too() -> None:
    """In a loop its last value but one is followed by the first one: 0 0 3 0 jumps by 3 at its end."""

    def stepped(*values: float) -> LoopGap:
        keys = np.outer(values, [1.0, 0, 0])
        return loop_gap(clips.track("translation", range(len(keys)), keys, STEP), end=len(keys) - 1)

    assert stepped(0, 0, 3, 0) == LoopGap(ContinuityClass.JUMP, 3, 0, 0)
    assert stepped(0, 3, 0, 2) == LoopGap(ContinuityClass.JUMP, 2, 0, 0)  # shown by players that stop at the end
    assert stepped(0, 3, 0, 0) == LoopGap(ContinuityClass.C2, 0, 0, 0)
    late = clips.track("translation", [0, 1, 2], np.outer([0, 3, 0], [1.0, 0, 0]), STEP)
    assert loop_gap(late, end=3).grade is ContinuityClass.C2  # the track ends before the clip does
    turned = clips.track("rotation", [0, 1, 2], clips.about("z", [0, 90, 360]), STEP)
    assert loop_gap(turned, end=2).value_jump == pytest.approx(np.pi / 2)


def test_a_track_that_ends_before_its_clip_rests_at_the_seam() -> None:
    bump = clips.track("translation", [0, 1, 2], [[0, 0, 0], [1, 0, 0], [0, 0, 0]])
    assert loop_gap(bump, end=2).speed_jump == 2
    assert loop_gap(bump, end=3).speed_jump == 1
