"""Poses of several clips as one, and samplers of the last clips."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.error import posed_clips
from anim.measure.error.posed_clips import AskedTimes, RecentSamplers, has_weights, pose_clips
from anim.model import Clip
from anim.sampling.players import sampler_for
from anim.sampling.pose import PoseSampler
from tests.clips import about, clip, skeleton, track

NODES = skeleton([-1, 0])


def _turn(degrees: float, node: int) -> Clip:
    return clip(track("rotation", [0, 1], about("z", [0, degrees]) * 1.01, node=node))


def test_frames_of_two_clips_in_two_players() -> None:
    """Each at its own times, in the order that they are asked for, some of them twice."""
    clips = _turn(90, 0), _turn(60, 1)
    asked = [
        AskedTimes("spec", np.array([0, 0.5, 0.5, 0.1, 0.9]), np.array([0, 0, 0, 1, 1])),
        AskedTimes("raw", np.array([0.2, 0.9, 1]), np.array([1, 1, 1])),
    ]
    found = pose_clips(NODES, {n: PoseSampler(NODES, each) for n, each in enumerate(clips)}, asked).pose
    frames = [(each.player, t, n) for each in asked for t, n in zip(each.times, each.clip, strict=True)]
    assert found.times.tolist() == [t for _, t, _ in frames]
    for rotation, (player, time, n) in zip(found.rotation, frames, strict=True):
        expected = sampler_for(NODES, clips[n], player=player).at(np.array([time])).rotation[0]
        assert rotation == pytest.approx(expected, abs=1e-15)


def test_clips_with_weights() -> None:
    assert not has_weights(_turn(1, 0))
    assert has_weights(_turn(1, 0), clip(track("weights", [0], [[1.0]])))
    assert has_weights(clip(track("/meshes/0/weights", [0], [[1.0]])))


def test_the_oldest_samplers_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each pair has four keys: two pairs are kept, or one of a longer clip."""
    monkeypatch.setattr(posed_clips, "MAX_RECENT_KEYS", 9)
    pairs = [(_turn(n, 0), _turn(n, 1)) for n in range(3)]
    recent = RecentSamplers()
    for pair in pairs:
        samplers = PoseSampler(NODES, pair[0]), PoseSampler(NODES, pair[1])
        assert recent.find(*pair) is None
        assert recent.add(*pair, samplers) is recent.find(*pair) is samplers
    assert [recent.find(*pair) is not None for pair in pairs] == [False, True, True]
    long = clip(track("rotation", np.arange(20), about("z", np.arange(20))))
    recent.add(long, long, (PoseSampler(NODES, long),) * 2)
    assert [recent.find(*pair) is not None for pair in (*pairs, (long, long))] == [False, False, False, True]
