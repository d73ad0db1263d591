"""Keys that rounding made redundant: they go where that saves bytes, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from anim.measure.inspect.track_statistics import stats
from anim.model import Clip
from anim.optimization.optimize import Optimized, optimize
from anim.optimization.options import Bounds, Packing, Policy, Request
from anim.optimization.search.plan import Solution
from anim.optimization.tracks.quantization import EncodedKeys
from anim.optimization.tracks.redundant_keys import drop_redundant_keys
from anim.sampling.batch import concatenate
from tests.anim.optimization.making import scene
from tests.clips import clip, track
from tests.files import glb_of, opened, opened_fixture

SKELETON = scene().skeleton
LINE = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [5, 0, 0]])  # keys 1 and 2 lie on the way to key 3
BEND = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [4, 0, 0], [5, 0, 0]])  # key 1 on the way to key 2


def _solution(what: Clip) -> Solution:
    stored = tuple(EncodedKeys(each.values, "exponent", bytes(range(12)) * len(each.times)) for each in what.tracks)
    return Solution(what, stored, ())


def _request(keep: frozenset[int] = frozenset()) -> Request:
    return Request(Bounds(1e-3, 0.02), Policy(keep=keep))


def _slim(old: Solution) -> Solution:
    new = drop_redundant_keys(old, SKELETON, _request())
    assert new is not None
    return new


def test_keys_go_that_every_track_on_the_axis_can_do_without() -> None:
    times = np.arange(5.0)
    old = _solution(clip(track("translation", times, LINE), track("scale", times, BEND, node=1)))
    new = _slim(old)
    first, second = new.clip.tracks
    assert first.times.tolist() == second.times.tolist() == [0, 2, 3, 4]
    assert first.times is second.times
    assert (second.values == BEND[[0, 2, 3, 4]]).all()
    for each, now in zip(new.clip.tracks, new.stored, strict=True):
        assert (now.values == each.values).all()
        assert now.codes == bytes(range(12)) * 4


def test_keys_are_judged_again_when_their_neighbors_went() -> None:
    """A straight line of a hundred keys needs two."""
    times = np.arange(100.0)
    old = _solution(clip(track("translation", times, np.outer(times, [1.0, 2, 3]))))
    new = _slim(old)
    assert new.clip.tracks[0].times.tolist() == [0, 99]


def test_exact_tracks_and_clips_without_such_keys_stay() -> None:
    old = _solution(clip(track("translation", np.arange(5.0), LINE, node=2)))
    assert drop_redundant_keys(old, SKELETON, _request(frozenset({2}))) is None
    assert drop_redundant_keys(old, SKELETON, Request(Bounds(0.0, 0.02))) is None
    needed = _solution(clip(track("translation", np.arange(3.0), LINE[2:])))
    assert drop_redundant_keys(needed, SKELETON, _request()) is None


def _redundant(document: Document) -> int:
    """Redundant keys of tracks that move, in all clips, as `inspect` counts them."""
    found = stats(
        concatenate([track for clip in reader.clips(document) for track in clip.tracks]), reader.skeleton(document)
    )
    return int(found.redundant[~found.constant].sum())


def _optimized(document: Document, packing: Packing) -> tuple[Request, Optimized]:
    diagonal = ErrorMetric(reader.scene(document)).diagonal
    request = Request(Bounds(1e-4 * diagonal, 0.01 * diagonal), packing=packing, effort="fast")
    return request, optimize(document, reader.scene(document), reader.clips(document), request)


@pytest.mark.parametrize("packing", [Packing.CORE, Packing.EXT])
def test_none_is_left_of_the_biped(packing: Packing) -> None:
    document = opened_fixture("biped")
    request, found = _optimized(document, packing)
    assert all(each.holds and each.certified is not None for each in found.verdicts.values())
    written = opened(glb_of(found.document))
    assert _redundant(document) > 0
    assert _redundant(written) == 0
    again = optimize(written, reader.scene(written), reader.clips(written), request)
    assert glb_of(again.document) == glb_of(found.document)
