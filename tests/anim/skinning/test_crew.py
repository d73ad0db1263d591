"""A crew's tasks: all done, in order where there is one worker, errors where results are asked for."""

from __future__ import annotations

import threading

import pytest

from anim.skinning.crew import Crew


@pytest.mark.parametrize("size", [1, 2, 5])
def test_all_is_done_and_results_are_those_of_the_calls(size: int) -> None:
    with Crew(size) as crew:
        futures = [crew.submit(pow, each, 2) for each in range(100)]
        assert [crew.result(each) for each in futures] == [each**2 for each in range(100)]


def test_one_alone_works_in_order_and_only_while_it_waits() -> None:
    seen: list[int] = []
    before = threading.active_count()
    with Crew(1) as crew:
        futures = [crew.submit(seen.append, each) for each in range(5)]
        assert (seen, threading.active_count()) == ([], before)
        crew.result(futures[2])
        assert seen == [0, 1, 2]
    assert seen == [0, 1, 2], "the rest is dropped"


def test_whoever_waits_works_too() -> None:
    """Both tasks wait for each other: a waiting thread that did none of them would wait for good."""
    barrier = threading.Barrier(2, timeout=20)
    with Crew(2) as crew:
        both = [crew.submit(barrier.wait) for _ in range(2)]
        assert sorted(crew.result(each) for each in both) == [0, 1]


@pytest.mark.parametrize("size", [1, 3])
def test_errors_come_where_the_result_is_asked_for(size: int) -> None:
    with Crew(size) as crew:
        bad, good = crew.submit(int, "no number"), crew.submit(int, "7")
        assert crew.result(good) == 7
        with pytest.raises(ValueError, match="no number"):
            crew.result(bad)


def test_an_interrupt_stops_whoever_works_at_once() -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    with Crew(1) as crew:
        crew.submit(interrupted)
        later = crew.submit(int)
        with pytest.raises(KeyboardInterrupt):
            crew.result(later)


def test_nobody_is_left_behind() -> None:
    before = threading.active_count()

    def left() -> None:
        with Crew(4) as crew:
            crew.submit(int)
            raise LookupError

    with pytest.raises(LookupError):
        left()
    assert threading.active_count() == before
