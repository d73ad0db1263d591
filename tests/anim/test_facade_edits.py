"""`import anim`: documents whose JSON was edited by hand."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import anim
from anim import ops


def _with_buffer(biped: Path) -> anim.Asset:
    """The biped with a buffer of six floats, a view and an accessor appended to its JSON."""
    asset, data = anim.load(biped), np.arange(6, dtype="<f4").tobytes()
    address = f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    content = asset.document.json
    content["buffers"].append({"byteLength": len(data), "uri": address})
    content["bufferViews"].append({"buffer": len(content["buffers"]) - 1, "byteLength": len(data)})
    view = len(content["bufferViews"]) - 1
    content["accessors"].append({"bufferView": view, "componentType": 5126, "count": 6, "type": "SCALAR"})
    return asset


@pytest.mark.parametrize(
    "change",
    [
        lambda asset: asset,
        lambda asset: asset.map_clips(lambda clip: ops.retime(clip, speed=2)),
        lambda asset: anim.optimize(asset, max_error="1mm", effort="fast").asset,
    ],
    ids=["save", "map_clips", "optimize"],
)
@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_a_buffer_appended_to_the_json_is_saved(
    change: Callable[[anim.Asset], anim.Asset], ending: str, biped: Path, tmp_path: Path
) -> None:
    change(_with_buffer(biped)).save(tmp_path / f"out.{ending}")
    again = anim.load(tmp_path / f"out.{ending}").document
    assert again.buffers[1].data.tobytes() == np.arange(6, dtype="<f4").tobytes()
    assert [accessor["count"] for accessor in again.json["accessors"]].count(6) >= 1


NO_CHANGE: dict[str, Callable[[anim.Asset], anim.Asset]] = {
    "map_clips": lambda asset: asset.map_clips(lambda clip: clip),
    "add_clips": lambda asset: asset.add_clips([]),
}


@pytest.mark.parametrize("name", NO_CHANGE)
def test_edits_of_a_new_asset_leave_the_old_one_even_if_no_clip_changed(name: str, biped: Path) -> None:
    asset, out = anim.load(biped), io.BytesIO()
    same = NO_CHANGE[name](asset)
    same.save(out)
    assert out.getvalue() == biped.read_bytes()
    same.document.json["nodes"][0]["name"] = "pelvis"
    assert asset.document.json["nodes"][0]["name"] == "hips"


@pytest.mark.parametrize("name", NO_CHANGE)
def test_a_new_asset_has_the_clips_of_the_edited_json_even_if_none_changed(name: str, biped: Path) -> None:
    asset = anim.load(biped)
    assert asset.clips.names == ("walk", "wave", "jump")
    del asset.document.json["animations"][1]
    assert NO_CHANGE[name](asset).clips.names == ("walk", "jump")


BROKEN: dict[str, tuple[Callable[[Any], object], str]] = {
    "sampler": (lambda j: j["animations"][0]["channels"][0].update(sampler=999), "animations[0].channels[0].sampler"),
    "negative": (lambda j: j["animations"][0]["channels"][0].update(sampler=-1), "animations[0].channels[0].sampler"),
    "accessors": (lambda j: j["accessors"].clear(), "animations[0].samplers[0].input"),
    "buffers": (lambda j: j["buffers"].pop(), "bufferViews[0].buffer"),
    "channels": (lambda j: j["animations"][0].pop("channels"), "animations[0]"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_references_broken_by_an_edit_are_named_with_their_path(fault: str, biped: Path) -> None:
    edit, where = BROKEN[fault]
    uses: tuple[Callable[[Any], object], ...] = (
        lambda asset: asset.clips,
        lambda asset: asset.scene,
        lambda asset: asset.map_clips(lambda clip: ops.retime(clip, speed=2)),
        lambda asset: asset.save(io.BytesIO()),
    )
    for use in uses:
        asset = anim.load(biped)
        edit(asset.document.json)
        with pytest.raises(anim.FormatError) as caught:
            use(asset)
        assert caught.value.where == where


@pytest.mark.parametrize(
    ("extras", "where"),
    [
        ({"weight": np.float32(1)}, "nodes[0].extras.weight"),
        ({"tags": [1, {"a"}]}, "nodes[0].extras.tags[1]"),
        ({"by": {(1, 2): 3}}, "nodes[0].extras.by"),
    ],
)
def test_values_that_are_no_json_are_named_with_their_path(extras: Any, where: str, biped: Path) -> None:
    asset = anim.load(biped)
    asset.document.json["nodes"][0]["extras"] = extras
    with pytest.raises(anim.FormatError, match="is no JSON value") as caught:
        asset.save(io.BytesIO())
    assert caught.value.where == where


def test_edits_after_a_view_was_used_are_seen(biped: Path) -> None:
    asset = anim.load(biped)
    assert asset.clips.names == ("walk", "wave", "jump")
    asset.document.json["animations"].reverse()
    halved = asset.map_clips(lambda clip: ops.retime(clip, speed=2), clips="walk")
    assert [(clip.name, clip.end) for clip in halved.clips] == [("jump", np.float32(1.6)), ("wave", 2), ("walk", 0.5)]
    assert list(anim.optimize(asset, clips="jump").errors) == ["jump"]
    assert np.allclose(anim.sample(asset, 0, times=[0.8]), anim.sample(biped, "jump", times=[0.8]))
    del asset.document.json["animations"][0]
    assert asset.map_clips(lambda clip: ops.retime(clip, speed=2)).clips.names == ("wave", "walk")
    assert anim.diff(biped, asset).max_error == float("inf")


@pytest.mark.parametrize("normals", [False, True])
def test_a_bake_checks_edits(normals: bool, biped: Path) -> None:
    asset = anim.load(biped)
    asset.document.json["nodes"][3]["rotation"] = [0, 0, 1, "a"]
    with pytest.raises(anim.FormatError, match=re.escape("nodes[3].rotation: holds a string")):
        anim.bake(asset, "walk", normals=normals)


def test_a_pointer_track_names_its_extension(biped: Path) -> None:
    pointer = "/materials/0/pbrMetallicRoughness/metallicFactor"
    track = anim.Track(None, "pointer", "LINEAR", [0, 1], [[1], [0]], pointer=pointer)
    asset = anim.load(biped)
    added = asset.add_clips([anim.Clip("shine", (track,))])
    changed = asset.map_clips(lambda clip: replace(clip, tracks=(*clip.tracks, track)), clips="walk")
    for each in (added, changed, changed.map_clips(lambda clip: ops.retime(clip, speed=2))):
        assert each.document.json["extensionsUsed"] == ["KHR_animation_pointer"]
    assert "extensionsUsed" not in asset.document.json
