"""Solutions as a document: exactly what they hold is read back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.optimization.options import Packing
from anim.optimization.search.plan import Solution
from anim.optimization.writing import changed_clips, write_solutions
from tests.anim.optimization.making import setting_of, solved, task_of
from tests.files import glb_of, opened, opened_fixture


def _solutions(name: str, packing: Packing) -> dict[int, Solution]:
    document = opened_fixture(name)
    clips = reader.clips(document)
    context = setting_of(reader.scene(document), clips, packing=packing)
    solutions = {}
    for i, clip in enumerate(clips):
        found = solved(context, task_of(clip, 1e-3))
        assert found is not None
        solutions[i] = found
    return solutions


@pytest.mark.parametrize("packing", list(Packing))
@pytest.mark.parametrize("name", ["noop", "interpolations", "morph_cube", "pointer", "arm"])
def test_every_number_is_read_back_as_it_was_solved(name: str, packing: Packing) -> None:
    document = opened_fixture(name)
    solutions = _solutions(name, packing)
    new = opened(glb_of(write_solutions(document, solutions, packing)))
    assert changed_clips(reader.clips(new), solutions) == []
    for i, clip in enumerate(reader.clips(new)):
        for a, b in zip(solutions[i].clip.tracks, clip.tracks, strict=True):
            assert (a.target, a.interpolation) == (b.target, b.interpolation)
            assert (a.times == b.times).all()
            assert (a.values == b.values).all()


def test_clips_that_differ_are_found() -> None:
    document = opened_fixture("noop")
    solutions = _solutions("noop", Packing.CORE)
    new = write_solutions(document, solutions, Packing.CORE)
    number, solution = next((i, each) for i, each in solutions.items() if len(each.clip.tracks[0].times) > 1)
    track, *others = solution.clip.tracks
    changes = (
        {"values": np.nextafter(track.values, np.inf)},
        {"time_axis": track.times + 1},
        {"node": 1 - (track.node or 0)},
    )
    for change in changes:
        clip = replace(solution.clip, tracks=(replace(track, **change), *others))
        assert changed_clips(reader.clips(new), {**solutions, number: replace(solution, clip=clip)}) == [number]
    fewer = replace(solution, clip=replace(solution.clip, tracks=solution.clip.tracks[1:]))
    assert changed_clips(reader.clips(new), {number: fewer}) == [number]


def test_only_solved_clips_are_replaced() -> None:
    document = opened_fixture("noop")
    solutions = _solutions("noop", Packing.CORE)
    last = max(solutions)
    new = write_solutions(document, {last: solutions[last]}, Packing.CORE)
    for i, (a, b) in enumerate(zip(reader.clips(document), reader.clips(new), strict=True)):
        same = len(a.tracks) == len(b.tracks) and all(
            np.array_equal(x.values, y.values) for x, y in zip(a.tracks, b.tracks, strict=True)
        )
        assert same or i == last
