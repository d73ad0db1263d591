"""Packed files written again: the same bytes, plain as if never packed, and other clips still there."""

from __future__ import annotations

import pytest

from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip
from fixtures.broken.pieces import animated, glb, text
from tests.anim.gltf.meshopt.packing import EXTENSIONS, filtered_clips, packed, streams
from tests.anim.gltf.meshopt.to_pack import PATHS, Find, as_float32, check_clips, packed_walk
from tests.anim.gltf.writing.documents import rewritten
from tests.files import glb_of, opened, opened_path


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", PATHS[:4])
def test_packing_again_changes_no_byte(name: str, extension: str, asset: Find) -> None:
    document = opened_path(asset(name))
    clips = filtered_clips(reader.clips(document))
    once = glb_of(writer.replace_clips(document, clips, extension=extension))
    assert glb_of(writer.replace_clips(opened(once), clips, extension=extension)) == once


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", PATHS[:4])
def test_plain_after_packed_is_as_if_never_packed(name: str, extension: str, asset: Find) -> None:
    """No dead byte, no buffer, no name of an extension is left."""
    document = opened_path(asset(name))
    clips, after = packed(document, extension)
    direct, back = writer.replace_clips(document, clips), writer.replace_clips(opened(glb_of(after)), clips)
    assert back.json["buffers"] == direct.json["buffers"]
    assert back.json.get("extensionsUsed") == direct.json.get("extensionsUsed")
    assert back.json.get("extensionsRequired") == direct.json.get("extensionsRequired")
    assert len(glb_of(back)) == len(glb_of(direct))
    check_clips({i: as_float32(clip) for i, clip in clips.items()}, back)


def test_other_clips_of_a_packed_file_stay() -> None:
    """Two clips in the same streams; one is written anew, the other still finds its numbers."""
    walk, _ = packed_walk(EXTENSIONS[0])
    document = opened(glb(text(animated() | {"nodes": [{}], "animations": animated()["animations"] * 2})))
    run = Clip("run", (walk.tracks[0].with_keys(walk.tracks[0].time_axis, walk.tracks[0].values[::-1]), walk.tracks[1]))
    clips = filtered_clips([walk, run])
    after = writer.replace_clips(document, clips, extension=EXTENSIONS[0])
    again = opened(glb_of(writer.replace_clips(after, {0: clips[0]})))
    check_clips(clips, again)
    assert len(streams(again, EXTENSIONS[0])) == 2
    assert "extensionsRequired" not in rewritten(again).json
