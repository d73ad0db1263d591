"""A crew's tasks: all done, in order where there is one worker, errors where results are asked for."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from pathlib import Path
from weakref import ref

import pytest

from anim.skinning.crew import Crew

ROOT = Path(__file__).resolve().parents[3]


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


def test_threads_start_when_there_is_work_for_them() -> None:
    before = threading.active_count()
    with Crew(64) as crew:
        one = crew.submit(pow, 2, 3)
        assert threading.active_count() == before, "whoever waits does it"
        crew.result(one)
        barrier = threading.Barrier(3, timeout=20)
        three = [crew.submit(barrier.wait) for _ in range(3)]
        assert threading.active_count() <= before + 2
        for each in three:
            crew.result(each)


def test_a_system_without_more_threads_is_no_reason_to_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", full)
    with Crew(4) as crew:
        futures = [crew.submit(pow, each, 2) for each in range(9)]
        assert [crew.result(each) for each in futures] == [each**2 for each in range(9)]


def test_what_was_done_is_forgotten() -> None:
    """A thread that waits for the next task must not hold the arrays of the last one."""

    class Large:
        pass

    with Crew(2) as crew:
        large = Large()
        last = ref(large)
        futures = [crew.submit(isinstance, large, Large) for _ in range(9)]
        del large
        assert all(crew.result(each) for each in futures)
        for _ in range(1000):
            if last() is None:
                break
            time.sleep(0.001)
        assert last() is None


def test_a_process_ends_though_a_generator_is_half_used() -> None:
    """Python 3.13 closes it when threads can't run any more, and would wait for them for good."""
    script = """
import threading
from anim.skinning.crew import Crew
def chunks():
    with Crew(3) as crew:
        while True:
            yield [crew.result(each) for each in [crew.submit(pow, 2, 3) for _ in range(5)]]
kept = chunks()
print(next(kept), threading.active_count())
"""
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (run.returncode, run.stdout.split("]")[0], run.stderr) == (0, "[8, 8, 8, 8, 8", "")
