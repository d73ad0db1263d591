"""What is said of all times: proven, how far at most, or why not."""

from __future__ import annotations

import pytest

from anim.measure.error.motion_error import MotionError
from anim.optimization.options import Bounds, Policy, Reference, Request
from anim.optimization.verification import Verification
from cli.reports import optimize_bound

REQUEST = Request(Bounds(1e-3, 0.01))
KEYS = Request(Bounds(1e-3, 0.01), Policy(reference=Reference.KEYS))
SCALE = 2.0  # m


def _verdict(certified: float | None, error: float = 9e-4) -> Verification:
    return Verification(MotionError(error, 0.5, "body", "arm", 100), "spec", None, 0.9, certified)


@pytest.mark.parametrize(
    ("certified", "words"),
    [
        ((9.1e-4, 9.9e-4), ", bound holds at all times"),
        ((9.1e-4, 1.01e-3), ", at all times at most 1.1 mm"),
        ((9.1e-4, None), ", bound not proven between samples"),
    ],
)
def test_of_all_clips(certified: tuple[float | None, ...], words: str) -> None:
    verdicts = [_verdict(each) for each in certified]
    assert optimize_bound.summary(verdicts, REQUEST, SCALE) == words
    assert optimize_bound.summary(verdicts, KEYS, SCALE) == ""


def test_where_nothing_moved_nothing_is_said() -> None:
    assert optimize_bound.summary([_verdict(None, 0.0)], REQUEST, SCALE) == ""
    assert optimize_bound.summary([], REQUEST, SCALE) == ""


@pytest.mark.parametrize(
    ("certified", "words"),
    [
        (9.101e-4, ", at most 0.92 mm at any time"),
        (9.1e-4, ", at most 0.91 mm at any time"),
        (1.2345e-2, ", at most 1.3 cm at any time"),
        (0.0, ", at most 0 mm at any time"),
        (None, ", bound not proven between samples"),
    ],
)
def test_of_a_clip(certified: float | None, words: str) -> None:
    """Rounded up: what is said is no less than what is proven."""
    assert optimize_bound.of_clip(_verdict(certified), REQUEST) == words
    assert optimize_bound.of_clip(_verdict(certified), KEYS) == ""


def test_why_not() -> None:
    assert optimize_bound.why_not(_verdict(1e-4), REQUEST) is None
    assert optimize_bound.why_not(_verdict(None), REQUEST) == "bound not proven between samples"
    assert optimize_bound.why_not(_verdict(None), KEYS) == "only the source's keys count"
