"""Random clips: written and read, they are the same, and the validator has nothing to say."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import writer
from anim.gltf.writing.byte_ranges import Range, union
from anim.model import Clip, Interpolation, Track
from fixtures.broken.pieces import animated, glb, text
from tests.anim.gltf.writing.documents import check_same, rewritten
from tests.clips import track
from tests.files import glb_of, opened
from tests.khronos import errors, needs_validator, validate_many

Json = dict[str, Any]
Find = Callable[[str], Path]

WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}
SINGLE = st.floats(-1e6, 1e6, width=32)


@st.composite
def any_track(draw: st.DrawFn, target: tuple[int, str]) -> Track:
    """Any track on a node, its numbers as a file can hold them."""
    node, path = target
    mode = draw(st.sampled_from(Interpolation))
    cubic = mode is Interpolation.CUBICSPLINE
    times = sorted(draw(st.sets(st.floats(0, 1e4, width=32), min_size=1 + cubic, max_size=5)))
    count = len(times) * WIDTHS[path]
    rows = [draw(st.lists(SINGLE, min_size=count, max_size=count)) for _ in range(3 if cubic else 1)]
    keys, *sides = (np.reshape(row, (len(times), WIDTHS[path])) for row in rows)
    if path == "rotation":
        keys[:, 3] += 4e6
        keys = (keys / np.linalg.norm(keys, axis=1, keepdims=True)).astype(np.float32)
    return track(path, times, keys, mode, node=node, tangents=(sides[0], sides[1]) if cubic else None)


@st.composite
def any_clip(draw: st.DrawFn) -> Clip:
    """Any clip on three nodes."""
    targets = draw(st.sets(st.tuples(st.integers(0, 2), st.sampled_from(sorted(WIDTHS))), min_size=1, max_size=4))
    return Clip(draw(st.text(max_size=5)), tuple(draw(any_track(target)) for target in sorted(targets)))


@settings(max_examples=60)
@given(clips=st.lists(any_clip(), min_size=1, max_size=2), again=any_clip())
def test_random_clips_come_back(clips: list[Clip], again: Clip) -> None:
    content = animated() | {"nodes": [{}, {}, {}]}
    content["animations"] = [content["animations"][0]] * len(clips)
    document = writer.replace_clips(opened(text(content)), dict(enumerate(clips)))
    document = opened(glb_of(writer.replace_clips(document, {0: again})))
    for before, after in zip([again, *clips[1:]], reader.clips(document), strict=True):
        assert before.name == after.name
        found = {each.target: each for each in after.tracks}
        assert len(found) == len(before.tracks)
        for each in before.tracks:
            check_same(each, found[each.target])
    used = {s[key] for a in document.json["animations"] for s in a["samplers"] for key in ("input", "output")}
    held = union(_range(document, number) for number in used)  # axes may share bytes
    assert held == [(0, len(document.buffers[0].data))]
    assert glb_of(rewritten(document)) == glb_of(opened(glb_of(rewritten(document))))


def _range(document: Document, number: int) -> Range:
    about = document.json["accessors"][number]
    view = document.json["bufferViews"][about["bufferView"]]
    start = view.get("byteOffset", 0) + about.get("byteOffset", 0)
    return start, start + Accessors(document).raw(number).nbytes


@needs_validator
@settings(max_examples=1)
@given(clips=st.lists(any_clip(), min_size=40, max_size=40))
def test_random_clips_are_valid(clips: list[Clip]) -> None:
    content = glb(text(animated() | {"nodes": [{}, {}, {}], "scenes": [{"nodes": [0, 1, 2]}]}))
    written = [glb_of(writer.replace_clips(opened(content), {0: clip})) for clip in clips]
    assert [errors(report) for report in validate_many(written)] == [[]] * len(clips)
