"""Many ranges, nodes and frames at once: the same as one by one, with few calls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.loops import skin_motion
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.loop_analysis import analyze_loop, analyze_loops
from anim.measure.loops.seam import Seam, measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.sampling import clips as sampled_clips
from tests.anim.measure.loops.chains import AT, CHAIN, SWING, chain, swinging
from tests.calls import count_calls
from tests.clips import about, clip, track


def test_many_nodes_or_frames_are_posed_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames and clips one at a time give the same steps and seams, without the root's motion since the first frame."""
    scene = chain()
    walk = clip(
        track("translation", AT, np.stack((AT, 0 * AT, 0.1 * SWING), axis=1), node=0),
        track("rotation", AT, about("z", SWING), node=1),
    )
    parts = [LoopRange(each, 0.0, 0.9, 0.1, root=0) for each in (walk, swinging(j1=3))]
    skin = SkinMotion(scene)
    whole = _measured(skin, parts)
    monkeypatch.setattr(skin_motion, "MAX_MATRICES", 1)
    found = _measured(skin, parts)
    assert (found[0] == whole[0]).all()
    assert (found[1] == whole[1]).all()
    assert found[2] == whole[2]


def _measured(skin: SkinMotion, parts: Sequence[LoopRange]) -> tuple[Floats, Floats, list[Seam]]:
    """Steps, changes of velocity and seams of ranges."""
    steps = np.stack([np.stack((AT[:-1], AT[1:]))] * len(parts))
    changes = skin.velocity_changes(parts, np.stack([AT[1:-1]] * len(parts)))
    return skin.steps(parts, steps), changes, measure_seams(skin, parts)


def test_clips_are_analyzed_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three milliseconds each added up: forty take as many calls as two, and each gets its own result."""
    longer = clip(track("rotation", [0.0, 0.2, 0.5, 0.7], about("z", [0, 3, -2, 0.2]), node=1))
    kinds = [swinging(), swinging(j1=5), longer, swinging(j1=150), clip(track("scale", [0.0], [[1.0, 1, 1]]))]
    skin = SkinMotion(CHAIN)
    alone = [analyze_loop(skin, each) for each in kinds]
    counted = count_calls(monkeypatch, sampled_clips, "_sample_parts")
    found = analyze_loops(skin, kinds, [-1] * 5)
    few = len(counted)
    assert analyze_loops(skin, kinds * 8, [-1] * 40) == found * 8
    assert len(counted) == 2 * few
    assert [each.kind for each in found] == [each.kind for each in alone]
    assert len({each.kind for each in found}) >= 3
    for one, many in zip(alone, found, strict=True):
        assert (many.seam, many.inside.largest, many.fps) == pytest.approx((one.seam, one.inside.largest, one.fps))
