"""Error over time: the same as a look at each time alone, and the joints that make it."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.error.error_curve import JOINTS, error_curve
from anim.measure.error.metric import ErrorMetric
from anim.model import Scene
from anim.operations.resample import resample
from tests.clips import clip, skeleton
from tests.files import opened_fixture


def test_a_profile_is_the_error_time_by_time() -> None:
    document = opened_fixture("biped")
    ruler = ErrorMetric(reader.scene(document), shell=0.01)
    before = reader.clips(document)[0]
    after = resample(before, fps=6)
    found = error_curve(ruler, before, after, fps=30)
    for i in range(0, len(found.times), 7):
        alone = ruler.error_at(before, after, found.times[i : i + 1]).max_error
        assert found.error[i] == pytest.approx(alone, rel=2e-3, abs=2e-7 * ruler.diagonal)
    tops = [float(course.error.max()) for course in found.joints]
    assert len(tops) == JOINTS
    assert tops == sorted(tops, reverse=True)
    assert tops[0] == found.error.max()
    assert (np.max([course.error for course in found.joints], axis=0) <= found.error).all()


def test_a_profile_of_nothing() -> None:
    found = error_curve(ErrorMetric(Scene(skeleton([-1]), ())), clip(), clip())
    assert found.error.tolist() == [0]
    assert found.joints == ()
