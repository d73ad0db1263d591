"""Bounds of several clips at once: each has those that it has alone."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.continuous_bound import node_tracks, prover
from anim.measure.continuous_bound.influence_radius import influence_radius
from anim.measure.continuous_bound.interval_rise import ClipTimes, interval_rise, prepare_versions
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.measure.continuous_bound.sampled_clips import SampledClip, divide
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import cut_times
from anim.model import Clip, Scene
from tests.anim.measure.continuous_bound.making import ALL, pair
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, track

Pair = tuple[Clip, Clip]


def _clips() -> tuple[Scene, list[Pair]]:
    """Every interpolation, missing and constant tracks, morphed or not; and constants that begin late, off unit."""
    of, *first = pair(6, modes=(LINEAR, STEP), wild=(0.05,))
    modes = (STEP, CUBICSPLINE), (LINEAR,), (STEP, LINEAR), (CUBICSPLINE,)
    others = [pair(6 if n == 2 else n, modes=some, wild=(0.3,))[1:] for n, some in enumerate(modes, start=1)]
    late = track("rotation", [0.4], about("x", [20]) * 1.001, node=2)
    slide = track("translation", [0, 0.3, 0.5], np.array([[0, 0, 0], [0, 0.1, 0], [0, 0.1, 0.2]]), node=1)
    moved = track("translation", [0, 0.5], np.array([[0, 0, 0], [0, 0.1, 0.21]]), node=1)
    still = track("rotation", [0, 1], np.tile(about("y", 10), (2, 1)), node=3)
    return of, [(first[0], first[1]), *others, (clip(late, slide), clip(late, moved)), (clip(still), clip())]


def _sampled(ruler: ErrorMetric, before: Clip, after: Clip) -> SampledClip:
    times = cut_times(before, after, parts=2, step=0.2)
    return SampledClip(before, after, times, ruler.sample_errors(before, after, times, players=ALL))


def _check(found: Proof, expected: Proof) -> None:
    assert found.player == expected.player
    assert found.error[1:] == expected.error[1:]
    assert found.error.max_error == pytest.approx(expected.error.max_error, rel=1e-12)
    assert (found.bound is None) == (expected.bound is None)
    if expected.bound is not None:
        assert found.bound == pytest.approx(expected.bound, rel=1e-12)


@pytest.mark.parametrize(("block", "pairs", "length"), [(1, 100, 40), (3000, 1, 500), (250_000, 2048, 60)])
def test_proofs(monkeypatch: pytest.MonkeyPatch, block: int, pairs: int, length: int) -> None:
    monkeypatch.setattr(prover, "BLOCK", block)
    monkeypatch.setattr(node_tracks, "MAX_PAIRS", pairs)
    monkeypatch.setattr(ErrorMetric, "length", length)
    of, clips = _clips()
    ruler = ErrorMetric(of)
    sampled = [_sampled(ruler, *each) for each in clips]
    together = Prover(ruler).certify(sampled, enough=0.05)
    alone = [Prover(ruler).certified(*each, enough=0.05) for each in sampled]
    assert sum(each.bound is not None for each in alone) >= 4
    assert any(found.error.times > len(each.times) for found, each in zip(alone, sampled, strict=True))  # refined
    for found, expected in zip(together, alone, strict=True):
        _check(found, expected)


@pytest.mark.parametrize("order", [1, -1])
def test_rises(order: int) -> None:
    of, clips = _clips()
    ruler = ErrorMetric(of)
    reaches = [each for each in map(influence_radius, ruler.parts) if each is not None]
    each = [ClipTimes(prepare_versions((of, of), some), cut_times(*some, parts=2, step=0.1)) for some in clips[::order]]
    together = interval_rise(each, reaches, ALL)
    alone = [interval_rise([one], reaches, ALL) for one in each]
    assert np.array_equal(together.rise, np.concatenate([one.rise for one in alone], axis=1))
    assert np.array_equal(together.jump, np.concatenate([one.jump for one in alone], axis=1))
    assert together.jump.any()
    assert np.isfinite(together.rise).any()


def test_no_clips_have_no_proofs() -> None:
    assert Prover(ErrorMetric(_clips()[0])).certify([]) == []


def test_steps_are_filled_by_clips_and_divide_long_ones_as_alone() -> None:
    of, clips = _clips()
    one = _sampled(ErrorMetric(of), *clips[-1])
    counts = [3, 25, 4, 5, 1]
    sampled = [one._replace(times=np.arange(count + 1.0)) for count in counts]
    steps = [[(part.number, part.frames.start, part.frames.stop) for part in step] for step in divide(sampled, 10)]
    assert steps == [[(0, 0, 4)], [(1, 0, 11)], [(1, 10, 21)], [(1, 20, 26), (2, 0, 5)], [(3, 0, 6), (4, 0, 2)]]
