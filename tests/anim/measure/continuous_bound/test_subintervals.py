"""Numbers of parts that intervals between samples are divided into."""

from __future__ import annotations

import numpy as np

from anim.measure.continuous_bound.subintervals import MAX_PARTS, OpenIntervals


def test_parts_of_scenes_without_size() -> None:
    """Their margin is 0: nothing that rises is near enough, and what does not rise needs no subdivision."""
    rise = np.array([[0.0, 1e-3, np.inf, 1e-3]])
    found = OpenIntervals("spec", (rise, rise), rise, np.array([[True, True, True, False]]))
    assert found.num_parts(0.0).tolist() == [1, MAX_PARTS, MAX_PARTS, 1]
    assert found.num_parts(2.5e-4).tolist() == [1, 2, MAX_PARTS, 1]
