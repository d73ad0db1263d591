"""Requests, and the error of what was written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.measure.error.surface import diagonal
from anim.optimization.optimize import Optimized, optimize
from anim.optimization.options import Bounds, Request
from anim.sampling.players import PLAYERS
from tests.files import glb_of, opened, opened_fixture

EVERY = tuple(PLAYERS)


def request_for(document: Document, share: float, **more: Any) -> Request:
    size = diagonal(reader.scene(document))
    bounds = replace(more.pop("bounds", Bounds(0.0, 0.0)), max_error=share * size, shell=0.01 * size)
    return Request(bounds, **{"effort": "fast", **more})


def optimized(document: Document, request: Request, **more: Any) -> tuple[Optimized, Document]:
    """The outcome, and its document as read back from the bytes of a file."""
    found = optimize(document, reader.scene(document), reader.clips(document), request, **more)
    return found, opened(glb_of(found.document))


def error(before: Document, after: Document, players: Sequence[str] = EVERY) -> float:
    """The largest distance in any clip for any player, as a share of the diagonal; all clips must be there."""
    old, new = reader.clips(before), reader.clips(after)
    scene = reader.scene(before)
    ruler = ErrorMetric(scene, reader.scene(after), shell=0.01 * diagonal(scene))
    worst = 0.0
    assert [each.name for each in new] == [each.name for each in old]
    for a, b in zip(old, new, strict=True):
        assert (b.start, b.end) == (a.start, a.end)
        assert b.tracks or not a.tracks
        for player in players:
            worst = max(worst, ruler.error_at(a, b, dense_times(a, b), player=player).max_error)
    return worst / (ruler.diagonal or 1.0)


def waving() -> Document:
    """The biped with one of its clips."""
    document = opened_fixture("biped")
    (wave,) = [each for each in document.json["animations"] if each["name"] == "wave"]
    return replace(document, json={**document.json, "animations": [wave]})
