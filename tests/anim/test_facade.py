"""`import anim`: what it loads, opens, saves and refuses, against bytes and figures that are not its own."""

from __future__ import annotations

import inspect
import io
import json
import pickle
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import anim
import fixtures
from anim import ops

Array = NDArray[np.float64]
NAMES = [name for name in fixtures.FIXTURES if name in ("biped", "tube", "cubes", "noop")]


@pytest.mark.parametrize("name", NAMES)
def test_what_was_only_loaded_is_saved_with_its_bytes(name: str, tmp_path: Path) -> None:
    data = fixtures.build(name)
    (tmp_path / "in.glb").write_bytes(data)
    anim.save(anim.load(tmp_path / "in.glb"), tmp_path / "out.glb")
    assert (tmp_path / "out.glb").read_bytes() == data


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_changes_in_the_json_are_saved(ending: str, biped: Path, tmp_path: Path) -> None:
    anim.load(biped).save(tmp_path / f"in.{ending}")
    asset = anim.load(tmp_path / f"in.{ending}")
    asset.document.json["nodes"][0]["name"] = "renamed"
    asset.save(tmp_path / f"out.{ending}")
    assert anim.load(tmp_path / f"out.{ending}").skeleton.names[0] == "renamed"
    out = io.BytesIO()
    asset.save(out)
    assert anim.load(out.getvalue()).skeleton.names[0] == "renamed"


class _ShortFile(io.RawIOBase):
    """A raw file that accepts at most 1000 bytes per call, as the system may."""

    def __init__(self) -> None:
        self.data = b""

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        self.data += bytes(data[:1000])
        return min(len(data), 1000)


def test_short_writes_of_a_raw_file_are_completed(biped: Path) -> None:
    file = _ShortFile()
    anim.save(anim.load(biped), file)  # type: ignore[arg-type]
    assert file.data == biped.read_bytes()


def test_a_file_that_returns_no_count_gets_all_bytes(biped: Path) -> None:
    class Collector:
        data = b""

        def write(self, data: Any) -> None:
            self.data += bytes(data)

    file = Collector()
    anim.save(anim.load(biped), file)  # type: ignore[arg-type]
    assert file.data == biped.read_bytes()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("buffering", [-1, 0])
def test_a_full_disk_is_an_output_error(buffering: int, biped: Path) -> None:
    asset = anim.load(biped)
    raised: list[str] = []
    with suppress(OSError), open("/dev/full", "wb", buffering=buffering) as file:  # closing it raises again
        try:
            anim.save(asset, file)
        except anim.OutputError as error:
            raised.append(str(error))
    assert raised == ["/dev/full: can't be written (no space left on device)"]


@pytest.mark.parametrize(
    "call",
    [
        lambda asset, none: asset.map_clips(lambda clip: clip, clips=none),
        lambda asset, none: anim.optimize(asset, clips=none),
        lambda asset, none: anim.diff(asset, asset, clips=none),
        lambda asset, none: anim.bake(asset, meshes=none),
        lambda asset, none: ops.select_tracks(asset.clips[0], asset.skeleton, nodes=none),
        lambda asset, none: ops.select_tracks(asset.clips[0], asset.skeleton, paths=none),
    ],
    ids=["map_clips", "optimize", "diff", "bake", "nodes", "paths"],
)
@pytest.mark.parametrize("none", [[], ()])
def test_an_empty_selection_does_not_select_all(call: Callable[[Any, Any], Any], none: Any, biped: Path) -> None:
    with pytest.raises(anim.RangeError, match="is empty, which selects nothing") as caught:
        call(anim.load(biped), none)
    assert "=None selects all" in caught.value.help


def test_an_unknown_path_of_tracks_is_refused(biped: Path) -> None:
    asset = anim.load(biped)
    with pytest.raises(anim.RangeError, match="paths has 'rot'") as caught:
        ops.select_tracks(asset.clips[0], asset.skeleton, paths="rot")
    assert caught.value.help == "did you mean 'rotation'?"
    assert ops.select_tracks(asset.clips[0], asset.skeleton, paths=["rotation", "pointer"])


@pytest.mark.parametrize(
    ("wrong", "error", "said"),
    [
        (lambda folder: anim.load(folder / "nope.glb"), anim.FormatError, "nope.glb: can't be read"),
        (lambda folder: anim.load(io.StringIO("{}")), anim.ShapeError, "text"),  # type: ignore[arg-type]
        (lambda folder: anim.load(5), anim.ShapeError, "int"),  # type: ignore[arg-type]
        (lambda folder: anim.load(anim.load(folder / "biped.glb")), anim.ShapeError, "Asset"),  # type: ignore[arg-type]
        (lambda folder: anim.load(folder / "biped.glb").save(folder / "x.gtlf"), anim.RangeError, "gtlf"),
        (lambda folder: anim.load(folder / "biped.glb").save(folder / "no" / "x.glb"), anim.OutputError, "x.glb"),
        (lambda folder: anim.save(3, folder / "x.glb"), anim.ShapeError, "int"),  # type: ignore[arg-type]
    ],
)
def test_slips_are_told(wrong: Callable[[Path], object], error: type[anim.AnimError], said: str, biped: Path) -> None:
    with pytest.raises(error, match=said):
        wrong(biped.parent)


def test_clips_are_taken_by_name_and_index(biped: Path) -> None:
    clips = anim.load(biped).clips
    assert clips.names == ("walk", "wave", "jump")
    assert clips["wave"] is clips[1] is clips["#1"] is clips[-2]
    assert clips[:2] == (clips[0], clips[1])
    assert ("walk" in clips, "run" in clips, len(clips), len(list(clips))) == (True, False, 3, 3)
    with pytest.raises(anim.NotFoundError) as caught:
        clips["wlak"]
    assert caught.value.help == "did you mean 'walk'?"
    with pytest.raises(anim.NotFoundError, match="'#01'"):
        clips["#01"]
    with pytest.raises(anim.NotFoundError, match="walk, wave, jump"):
        clips[3]


def test_a_name_that_stands_twice_is_not_guessed(biped: Path) -> None:
    asset = anim.load(biped).map_clips(lambda clip: replace(clip, name="same"), clips="w*")
    assert asset.clips.names == ("same", "same", "jump")
    with pytest.raises(anim.NotFoundError) as caught:
        asset.clips["same"]
    assert "[0, 1]" in caught.value.help


def test_map_clips_changes_the_chosen_and_leaves_the_asset(biped: Path) -> None:
    asset = anim.load(biped)
    before = json.dumps(asset.document.json)
    slow = asset.map_clips(lambda clip: ops.retime(clip, speed=0.5), clips="wa*")
    assert [clip.end for clip in slow.clips] == [2 * asset.clips[0].end, 2 * asset.clips[1].end, asset.clips[2].end]
    assert json.dumps(asset.document.json) == before
    assert list(asset.map_clips(lambda clip: clip).clips) == list(asset.clips)
    with pytest.raises(anim.ShapeError, match="'walk': change returns int"):
        asset.map_clips(lambda clip: 3)  # type: ignore[arg-type, return-value]


def test_operations_take_easings_and_tangents_by_name(biped: Path) -> None:
    clip = anim.load(biped).clips["walk"]
    assert ops.ease(clip, easing="quad-in").tracks[0].interpolation == "CUBICSPLINE"
    assert ops.spline(clip, tangents="natural").tracks[0].interpolation == "CUBICSPLINE"
    assert ops.warp(clip, easing="sine-in-out").end == clip.end
    with pytest.raises(anim.RangeError, match="smothstep"):
        ops.ease(clip, easing="smothstep")


def test_tracks_are_selected_by_node_and_path(biped: Path) -> None:
    asset = anim.load(biped)
    clip = asset.clips["walk"]
    chosen = ops.select_tracks(clip, asset.skeleton, nodes=["hips"], paths=["rotation"])
    assert [(clip.tracks[i].node, clip.tracks[i].path) for i in chosen] == [(0, "rotation")]
    changed = ops.resample(clip, fps=7, tracks=chosen)
    assert [i for i, (a, b) in enumerate(zip(clip.tracks, changed.tracks, strict=True)) if a is not b] == list(chosen)


@pytest.mark.parametrize("name", sorted({*ops.__all__} - {"select_tracks"}))
def test_operations_are_in_the_docstring_and_take_tracks(name: str, biped: Path) -> None:
    operation = getattr(ops, name)
    assert re.search(rf"\b{name}\b", ops.__doc__ or ""), f"add a line for {name} to the docstring of anim/ops.py"
    parameters = inspect.signature(operation).parameters.values()
    assert "tracks" in {each.name for each in parameters}
    needed = {"blend": 0.2, "fps": 30.0, "speed": 0.5, "easing": "smoothstep", "tangents": "natural"}
    given = {
        each.name: needed[each.name]
        for each in parameters
        if each.kind is each.KEYWORD_ONLY and each.default is each.empty
    }
    clip = anim.load(biped).clips["walk"]
    changed = operation(clip, **given, tracks=frozenset())
    assert len(changed.tracks) == len(clip.tracks)
    assert all(new is old for new, old in zip(changed.tracks, clip.tracks, strict=True))


def test_clips_made_in_python_are_appended(biped: Path) -> None:
    asset = anim.load(biped)
    rise = anim.Track(0, "translation", "LINEAR", [0, 1], [[0, 0, 0], [0, 1, 0]])
    longer = asset.add_clips([anim.Clip("rise", (rise,)), anim.Clip("nothing", ())])
    out = io.BytesIO()
    longer.save(out)
    again = anim.load(out.getvalue())
    assert again.clips.names == (*asset.clips.names, "rise")
    (track,) = again.clips["rise"].tracks
    assert (track.node, track.path, track.interpolation) == (rise.node, rise.path, rise.interpolation)
    np.testing.assert_array_equal(track.values, rise.values)
    assert list(again.clips)[:-1] == list(asset.clips)
    assert asset.add_clips([]).clips.names == asset.clips.names
    with pytest.raises(anim.RangeError, match=r"clips\[0\] has a track of node 99"):
        asset.add_clips([anim.Clip("far", (anim.Track(99, "translation", "LINEAR", [0], [[0, 0, 0]]),))])
    with pytest.raises(anim.ShapeError, match=r"clips\[0\] is str"):
        asset.add_clips(["walk"])  # type: ignore[list-item]


def test_a_baked_cache_can_be_pickled(biped: Path) -> None:
    cache = anim.bake(biped, "walk", fps=8, normals=True)
    again = pickle.loads(pickle.dumps(cache))
    assert isinstance(again, type(cache))
    np.testing.assert_array_equal(again.times, cache.times)
    for _ in range(2):  # a new pass each time
        np.testing.assert_array_equal(again.load_all().positions, cache.load_all().positions)
        np.testing.assert_array_equal(again.load_all().normals, cache.load_all().normals)


def test_what_is_optimized_already_has_an_error_of_zero_for_each_clip(biped: Path) -> None:
    small = anim.optimize(biped, max_error="1mm", effort="fast")
    again = anim.optimize(small.asset, max_error="1mm", effort="fast")
    assert again.errors == dict.fromkeys(small.errors, 0.0)
    assert again.max_error == 0
