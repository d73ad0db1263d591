"""Weights within 0…1: worked by hand, and the same motion as before."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import AnyArray
from anim.caches.formats.morph_encoding import MorphEncoding, encode_morphs

RNG = np.random.default_rng(3)


def _frames(form: MorphEncoding) -> AnyArray:
    """The positions (F, V, 3) that a form stands for."""
    moved: AnyArray = np.einsum("fm,mvi->fvi", form.weights, form.targets.astype(np.float64))
    return form.scale * (form.base + moved)


def _form(targets: AnyArray, weights: list[list[float]], kind: str = "basis") -> MorphEncoding:
    base = np.array([[10.0, 0, 0], [0, 10, 0]], np.float32)
    return MorphEncoding(kind, base, targets.astype(np.float32), np.arange(len(weights)), np.array(weights))


TARGETS = np.array([[[1, 0, 0], [0, 0, 0]], [[0, 0, 0], [0, 0.5, 0]]])


def test_by_hand() -> None:
    """The first target goes on from its lower end, −1; the second is turned over: its upper end, 1, is nearer to 0."""
    form = encode_morphs(_form(TARGETS, [[-1, 1], [3, 0], [1, -7]]), quantize=False)
    assert form.base.tolist() == [[9, 0, 0], [0, 10.5, 0]]
    assert form.targets.tolist() == [[[4, 0, 0], [0, 0, 0]], [[0, 0, 0], [0, -4, 0]]]
    assert form.weights.tolist() == [[0, 0], [1, 0.125], [0.5, 1]]
    assert not np.signbit(form.weights).any()
    assert form.scale == 1


def test_a_target_that_never_changes_is_in_the_base() -> None:
    form = encode_morphs(_form(TARGETS, [[2, 0.25], [2, 0.75]]), quantize=False)
    assert form.base.tolist() == [[12, 0, 0], [0, 10.125, 0]]
    assert form.weights.tolist() == [[0], [1]]
    still = encode_morphs(_form(TARGETS, [[2, 1]]), quantize=True)
    assert (still.base.tolist(), still.weights.shape, still.scale) == ([[12, 0, 0], [0, 10.5, 0]], (1, 0), 1)


def test_integers_reach_as_far_as_vertices_move() -> None:
    """A target of 4 m in numbers up to 1: the node has the scale, small targets keep all their steps."""
    form = encode_morphs(_form(TARGETS, [[-1, 0], [3, 0.01], [1, 0]]), quantize=True)
    assert form.scale == 4
    assert np.abs(form.targets).max(axis=(1, 2)).tolist() == [1, 1]
    assert form.weights.max(axis=0) == pytest.approx([1, 0.005 / 4])
    assert _frames(form) == pytest.approx(_frames(_form(TARGETS, [[-1, 0], [3, 0.01], [1, 0]])), abs=1e-6)


@pytest.mark.parametrize("kind", ["basis", "keyframes"])
def test_a_shift_adds_nothing_to_what_integers_miss(kind: str) -> None:
    """Half a step of each target, times how far its weight is from the mean: not from an end of its range."""
    targets = RNG.uniform(-1, 1, (5, 40, 3))
    weights = RNG.uniform(-1 if kind == "basis" else 0, 1, (30, 5)) * 10.0 ** -np.arange(5)
    if kind == "keyframes":
        weights[0] = 0
    form = _form(np.zeros((5, 2, 3)), weights.tolist(), kind)
    form = MorphEncoding(kind, np.zeros((40, 3), np.float32), targets.astype(np.float32), form.frames, form.weights)
    found = encode_morphs(form, quantize=True)
    step = np.abs(targets).max(axis=(1, 2)) / 32767 / 2
    away = weights - (weights.mean(axis=0) if kind == "basis" else 0)
    bound = (np.abs(away) * step).sum(axis=1)
    missed = np.abs(_frames(found) - _frames(form)).max(axis=(1, 2))
    assert (missed <= bound + 3e-7).all()
    assert found.weights.min() >= 0
    assert found.weights.max() <= 1
