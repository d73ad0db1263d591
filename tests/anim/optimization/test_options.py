"""Options as values: names that reach the command line, and efforts that grow."""

from __future__ import annotations

import pytest

from anim.gltf.validation.buffer_layout import MESHOPT
from anim.optimization.options import EFFORTS, Drop, Objective, Packing, Policy, Reference, find_effort


def test_names_of_the_command_line() -> None:
    assert [str(each) for each in Drop] == ["rest", "unused", "never"]
    assert [str(each) for each in Reference] == ["curve", "keys"]
    assert [str(each) for each in Objective] == ["file", "gzip"]
    assert list(EFFORTS) == ["fast", "balanced", "max"]


def test_extensions() -> None:
    assert Packing.CORE.extension == ""
    assert {Packing.EXT.extension, Packing.KHR.extension} == set(MESHOPT)


def test_nothing_is_given_up_unless_asked_for() -> None:
    policy = Policy()
    assert (policy.drop, policy.rebase_rest, policy.drop_invisible) == (Drop.UNUSED, False, False)
    assert policy.reference is Reference.CURVE


@pytest.mark.parametrize("packing", Packing)
def test_each_effort_tries_what_a_smaller_one_does_and_more(packing: Packing) -> None:
    fast, balanced, most = (find_effort(name, packing) for name in EFFORTS)
    assert most.also_try == balanced
    for less, more in ((fast, balanced), (balanced, most)):
        assert less.rounds <= more.rounds
        assert set(less.axes) <= set(more.axes)
        assert set(less.leeways) <= set(more.leeways)
        assert less.long_track_rounds <= more.long_track_rounds
        assert less.random_trials <= more.random_trials
        assert less.coarsen_passes <= more.coarsen_passes
    assert all(0 < share < 1 for effort in EFFORTS.values() for share in effort.thresholds)
