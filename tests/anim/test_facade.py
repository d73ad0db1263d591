"""`import anim`: what it loads, opens, saves and refuses, against bytes and figures that are not its own."""

from __future__ import annotations

import base64
import inspect
import io
import json
import pickle
import pydoc
import re
import subprocess
import sys
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
ROOT = Path(__file__).resolve().parents[2]
MAX_MAP_LINES = 60
NAMES = [name for name in fixtures.FIXTURES if name in ("biped", "tube", "cubes", "noop")]


@pytest.fixture
def biped(tmp_path: Path) -> Path:
    path = tmp_path / "biped.glb"
    path.write_bytes(fixtures.build("biped"))
    return path


# Loading and saving.


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


def test_paths_bytes_and_files_load_alike(biped: Path) -> None:
    data = biped.read_bytes()
    for given in (str(biped), data, bytearray(data), memoryview(data), np.frombuffer(data, np.uint8), io.BytesIO(data)):
        out = io.BytesIO()
        anim.save(anim.load(given), out)
        assert out.getvalue() == data


@pytest.mark.parametrize("kind", [bytearray, memoryview, np.ndarray])
def test_an_asset_does_not_share_memory_that_can_change(kind: Any, biped: Path) -> None:
    """A reader's buffer, used again for the next file, changed the figure."""
    data = biped.read_bytes()
    buffer = bytearray(data)
    given: Any = {bytearray: buffer, memoryview: memoryview(buffer), np.ndarray: np.frombuffer(buffer, np.uint8)}[kind]
    asset = anim.load(given)
    buffer[len(buffer) // 2 :] = bytes(len(buffer) - len(buffer) // 2)
    np.testing.assert_array_equal(anim.sample(asset, "walk"), anim.sample(anim.load(data), "walk"))
    out = io.BytesIO()
    asset.save(out)
    assert out.getvalue() == data


def test_bytes_that_are_not_contiguous_load(biped: Path) -> None:
    data = biped.read_bytes()
    spread = bytearray(2 * len(data))
    spread[::2] = data
    assert len(anim.load(memoryview(spread)[::2]).clips) == len(anim.load(data).clips)
    assert len(anim.load(np.frombuffer(spread, np.uint8)[::2]).clips) == len(anim.load(data).clips)


@pytest.mark.parametrize("content", ["short", "zeros"])
def test_a_file_rewritten_in_place_does_not_change_what_was_loaded(content: str, biped: Path) -> None:
    """The interpreter was killed by SIGBUS: the pages of a mapped file were gone. So in a process of its own."""
    lines = (
        "import io, sys, anim",
        f"path = {str(biped)!r}",
        "data = open(path, 'rb').read()",
        "asset = anim.load(path)",
        f"other = b'short' if {content!r} == 'short' else data[: len(data) // 2].ljust(len(data), b'0')",
        "open(path, 'wb').write(other)",
        "out = io.BytesIO()",
        "asset.save(out)",
        "assert out.getvalue() == data",
        "assert (anim.sample(asset, 'walk') == anim.sample(anim.load(data), 'walk')).all()",
    )
    run = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, (run.returncode, run.stderr)


def test_a_file_that_fails_to_be_read_is_an_error_of_ours() -> None:
    class Failing(io.BytesIO):
        def read(self, size: int | None = -1) -> bytes:
            raise OSError(5, "Input/output error")

    with pytest.raises(anim.FormatError, match=r"can't be read \(input/output error\)"):
        anim.load(Failing())


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


# Edits of the JSON.


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


def test_a_gltf_gets_its_bin_beside_it_and_loads_from_there(biped: Path, tmp_path: Path) -> None:
    asset = anim.load(biped)
    asset.save(tmp_path / "walk.gltf")
    again = anim.load(tmp_path / "walk.gltf")
    assert {path.name for path in tmp_path.iterdir()} == {"biped.glb", "walk.gltf", "walk.bin"}
    assert anim.diff(asset, again).max_error == 0
    other = tmp_path / "other"
    other.mkdir()
    again.save(other / "copy.gltf")
    assert {path.name for path in other.iterdir()} == {"copy.gltf", "copy.bin"}


@pytest.mark.parametrize("address", ["../secret.bin", "/etc/hostname", "link.bin", "%2e%2e/secret.bin"])
def test_buffers_stay_in_the_folder_of_a_gltf(address: str, biped: Path, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    anim.load(biped).save(folder / "walk.gltf")
    (folder / "walk.bin").rename(tmp_path / "secret.bin")
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    content = json.loads((folder / "walk.gltf").read_text())
    content["buffers"][0]["uri"] = address
    (folder / "walk.gltf").write_text(json.dumps(content))
    with pytest.raises(anim.FormatError):
        list(anim.load(folder / "walk.gltf").clips)


def test_bytes_have_no_folder(biped: Path, tmp_path: Path) -> None:
    anim.load(biped).save(tmp_path / "walk.gltf")
    with pytest.raises(anim.FormatError, match="lies beside the file, but bytes have no folder"):
        list(anim.load((tmp_path / "walk.gltf").read_bytes()).clips)


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


# Clips.


def test_clips_are_taken_by_name_and_index(biped: Path) -> None:
    clips = anim.load(biped).clips
    assert clips.names == ("walk", "wave", "jump")
    assert clips["wave"] is clips[1] is clips["#1"] is clips[-2]
    assert clips[:2] == (clips[0], clips[1])
    assert ("walk" in clips, "run" in clips, len(clips), len(list(clips))) == (True, False, 3, 3)
    with pytest.raises(anim.NotFoundError) as caught:
        clips["wlak"]
    assert caught.value.help == "did you mean 'walk'?"
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
    assert asset.map_clips(lambda clip: clip) is asset
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


# The package.


def test_import_loads_nothing_until_it_is_used() -> None:
    script = "import anim, sys; dir(anim); print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert {name for name in loaded if name.startswith("anim")} == {"anim"}
    assert not loaded & {"numpy", "scipy", "typer", "cli", "asyncio", "inspect"}


def test_every_name_is_there_and_on_the_map() -> None:
    text = inspect.getdoc(anim) or ""
    assert len(text.splitlines()) <= MAX_MAP_LINES
    for name in anim.__all__:
        assert getattr(anim, name) is not None
        assert name in text or name in ("BakedCache", "OptimizeResult", "Interpolation")
    assert set(anim.__all__) <= set(dir(anim))
    assert "anim.load(" in pydoc.plain(pydoc.render_doc(anim))
    with pytest.raises(AttributeError, match="'lode'"):
        anim.lode  # noqa: B018


def test_the_hints_for_type_checkers_name_the_same() -> None:
    lines = [line.split() for line in inspect.getsource(anim).splitlines() if line.startswith("    from anim")]
    assert {line[-1]: line[1] for line in lines if line[-1] != "ops"} == anim._HOMES
    assert (ROOT / "anim" / "py.typed").is_file()


def test_functions_keep_their_names_when_rooms_are_imported() -> None:
    """A room of the same name would take the place of a function when it is first imported."""
    rooms = {path.name for path in (ROOT / "anim").iterdir() if path.is_dir()}
    assert not rooms & set(anim.__all__)
    assert {path.stem for path in (ROOT / "anim").glob("*.py")} & set(anim.__all__) == {"ops"}


def test_the_module_runs_the_command() -> None:
    run = subprocess.run([sys.executable, "-m", "anim", "--version"], cwd=ROOT, capture_output=True, text=True)
    assert (run.returncode, run.stderr) == (0, "")
    assert anim.__version__ in run.stdout


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
    assert asset.add_clips([]) is asset
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


# Documents edited by hand.


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
