"""Similarities of points: found again, and the one that turns least where points leave a choice."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.exchange.retarget.rest_alignment import fit_similarity

FIGURE = np.array(((0.0, 0, 0), (0, 1, 0), (0.3, 1, 0), (0, 1.5, 0.2)))
LINE = np.array(((0.0, 1, 0), (0, 2, 0), (0, 4.5, 0)))
TURN = Rotation.from_rotvec((0.4, -0.3, 0.2))


def _placed(points: Floats, turn: Rotation) -> Floats:
    return np.asarray(2.5 * turn.apply(points) + (3, -2, 100.0))


def test_a_figure_is_found_again() -> None:
    found = fit_similarity(FIGURE, _placed(FIGURE, TURN))
    assert found.unique
    assert found.scale == pytest.approx(2.5)
    assert found.error < 1e-12
    assert (Rotation.from_quat(found.rotation) * TURN.inv()).magnitude() < 1e-12


@pytest.mark.parametrize("turn", [Rotation.identity(), TURN, Rotation.from_rotvec((0, 0, np.pi))])
def test_a_line_turns_no_more_than_it_must(turn: Rotation) -> None:
    """Its turn is that between the two directions, by scipy; a turn about the line would add to it."""
    placed = _placed(LINE, turn)
    found = fit_similarity(LINE, placed)
    assert not found.unique
    assert found.scale == pytest.approx(2.5)
    assert found.error < 1e-12
    between = np.arccos(np.clip(turn.as_matrix()[1, 1], -1, 1))
    assert Rotation.from_quat(found.rotation).magnitude() == pytest.approx(between, abs=1e-12)


def test_a_line_with_other_distances_is_another() -> None:
    assert fit_similarity(LINE, LINE[:, [1, 0, 2]] * (1, 2, 1) + ((0, 0, 0), (1, 0, 0), (0, 0, 0))).error > 0.1
    assert fit_similarity(LINE, FIGURE[:3]).error > 0.1


def test_one_place_neither_turns_nor_grows() -> None:
    one, other = np.array(((1.0, 2, 3),)), np.array(((4.0, 4, 4),))
    found = fit_similarity(one, other)
    assert (found.rotation.tolist(), found.scale, found.error, found.unique) == ([0, 0, 0, 1], 1.0, 0.0, False)
    assert fit_similarity(np.repeat(one, 3, axis=0), LINE).error == np.inf
    assert fit_similarity(LINE, np.repeat(one, 3, axis=0)).error == np.inf
