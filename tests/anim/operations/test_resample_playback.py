"""Real files on a grid: playback that no eye can tell from the source, and no new fault for the validator."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fixtures
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip
from anim.operations.resample import resample
from tests.files import REAL, glb_of, mark_slow, opened, opened_fixture, opened_path
from tests.khronos import errors, needs_validator, validate_many

Find = Callable[[str], Path]

ENOUGH = 1e-5  # of the model's diagonal: what playback at a multiple of the source rate may differ by
PLAYED = 240  # Hz


@pytest.mark.parametrize("multiple", [1, 2])
@pytest.mark.parametrize("name", mark_slow(name for name in REAL if name != "Knight.glb"))
def test_a_multiple_of_the_source_rate_plays_back_the_source(name: str, multiple: int, asset: Find) -> None:
    _check_playback(opened_path(asset(name)), multiple, every=1)


@pytest.mark.slow
@pytest.mark.parametrize("multiple", [1, 2])
def test_a_multiple_of_the_source_rate_plays_back_the_knight(multiple: int, asset: Find) -> None:
    _check_playback(opened_path(asset("Knight.glb")), multiple, every=8)  # of its 76 clips


@needs_validator
@pytest.mark.slow
def test_the_validator_finds_no_new_fault(asset: Find) -> None:
    names = [*fixtures.FIXTURES, *REAL]
    documents = [opened_fixture(name) for name in fixtures.FIXTURES] + [opened_path(asset(name)) for name in REAL]
    data = [glb_of(each) for each in documents] + [glb_of(_resampled(each, fps=15)) for each in documents]
    reports = validate_many(data, limit=0)
    for name, before, after in zip(names, reports[: len(names)], reports[len(names) :], strict=True):
        assert not _error_codes(after) - _error_codes(before), (name, errors(after)[:5])


@pytest.mark.parametrize("name", fixtures.FIXTURES)
@pytest.mark.parametrize("interpolation", ["linear", "cubicspline", "step"])
def test_every_fixture_takes_every_goal(name: str, interpolation: str) -> None:
    document = opened_fixture(name)
    after = opened(glb_of(_resampled(document, fps=12, interpolation=interpolation)))
    for a, b in zip(reader.clips(document), reader.clips(after), strict=True):
        assert (a.start, a.end, len(a.tracks)) == (b.start, b.end, len(b.tracks))


def _check_playback(document: Document, multiple: int, *, every: int) -> None:
    ruler = ErrorMetric(reader.scene(document))
    for number, before in list(enumerate(reader.clips(document)))[::every]:
        after = resample(before, fps=multiple * _source_rate(before))
        written = reader.clips(writer.replace_clips(document, {number: after}))[number]
        assert (written.start, written.end) == (before.start, before.end)
        played = np.append(np.arange(before.start, before.end, 1 / PLAYED), before.end)
        found = ruler.error_at(before, written, played)
        assert found.max_error <= ENOUGH * ruler.diagonal, (before.name, found)
        assert found.max_pointer_error <= ENOUGH, (before.name, found)


def _source_rate(whole: Clip) -> int:
    """The lowest rate from 24 fps on whose frames, counted from the clip's start, all keys lie; the playback's if none.

    Slower rates say nothing: three cubic keys a second apart were made at 24 fps, not at 1.
    """
    keys = np.unique(np.concatenate([each.times for each in whole.tracks])) - whole.start
    fitting = (fps for fps in range(24, PLAYED) if np.abs(keys * fps - np.rint(keys * fps)).max() < 2e-3)
    return next(fitting, PLAYED)


def _resampled(document: Document, **options: Any) -> Document:
    clips = {i: resample(each, **options) for i, each in enumerate(reader.clips(document))}
    return writer.replace_clips(document, clips)


def _error_codes(report: dict[str, Any]) -> Counter[str]:
    return Counter(line.split(" ")[0] for line in errors(report))
