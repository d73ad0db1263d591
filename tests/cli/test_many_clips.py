"""Files of many clips and tracks: what they share is computed once, counted by calls."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from anim.gltf.writing import unknown_extensions
from anim.measure.inspect import frame_rate, storage_cost
from anim.show.plots import polylines, track_selection
from anim.skinning import chunk_pipeline
from anim.skinning.analysis.inbetween_error import InbetweenMetric
from anim.skinning.bake import Baker
from cli.io import documents
from cli.io.output_names import MAX_FILES
from cli.workflows import bake_source_options
from fixtures.broken.pieces import text
from tests import many
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.cli.running import help_line, refusal
from tests.cli.test_many import CLIPS, equal_clips
from tests.files import opened


def test_a_plot_computes_each_curve_once(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the number of its components, which each ask for their color."""
    pytest.importorskip("matplotlib")
    (tmp_path / "in.glb").write_bytes(many.targets(20))
    curves, speeds = (count_calls(monkeypatch, polylines, name) for name in ("value_line", "speed_line"))
    call("plot", tmp_path / "in.glb", tmp_path / "out.png").product()
    assert (len(curves), len(speeds)) == (1, 1)


def test_a_plot_of_many_tracks_prepares_those_that_it_draws(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "in.glb").write_bytes(many.channels(1000))
    counted = count_calls(monkeypatch, track_selection, "PlotTrack")
    said = call("plot", tmp_path / "in.glb", tmp_path / "out.png", "--limit", "2")
    said.product()
    assert "drew the first 2 of 1000 tracks that move" in said.err
    assert len(counted) == 2


def test_files_of_many_clips_are_checked_by_their_folder(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that are there already are checked one by one."""
    (tmp_path / "in.glb").write_bytes(morphing_clips(CLIPS))
    (tmp_path / "c7.npz").mkdir()
    counted = count_calls(monkeypatch, documents, "check_file")
    assert "c7.npz: is a folder" in refusal(call("bake", tmp_path / "in.glb", tmp_path / "{clip}.npz"), 2)
    assert len(counted) == 3  # the pattern, c0, c7
    (tmp_path / "c7.npz").rmdir()
    (tmp_path / "c8.npz").write_bytes(b"")
    counted.clear()
    call("bake", tmp_path / "in.glb", tmp_path / "{clip}.npz").product()
    assert len(counted) == 3
    assert len(list(tmp_path.glob("c*.npz"))) == CLIPS


@pytest.mark.parametrize(("command", "ending"), [("bake", "npz"), ("convert", "usda")])
def test_more_files_than_the_limit_are_refused_before_the_first(
    call: Call, tmp_path: Path, command: str, ending: str
) -> None:
    (tmp_path / "in.glb").write_bytes(many.clips_equal(3))
    options = ["--rigid"] * (command == "bake")
    run = call(command, tmp_path / "in.glb", tmp_path / f"{{clip}}.{ending}", *options, "--max-files", "2")
    assert "stands for 3 files (limit 2)" in refusal(run, 4)
    assert help_line(run) == "choose clips with --clip, or raise the limit with --max-files"
    assert not list(tmp_path.glob(f"*.{ending}"))
    (tmp_path / "in.glb").write_bytes(many.clips_equal(MAX_FILES + 1))
    run = call(command, tmp_path / "in.glb", tmp_path / f"{{clip}}.{ending}", *options)
    assert f"(limit {MAX_FILES})" in refusal(run, 4)


def test_small_bakes_start_no_threads_and_measure_equal_clips_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(morphing_clips(5))
    measured = count_calls(monkeypatch, InbetweenMetric, "largest_error")
    pools = count_calls(monkeypatch, chunk_pipeline, "ThreadPoolExecutor")
    run = call("bake", tmp_path / "in.glb", tmp_path / "{clip}.npz", "--fps", "2")
    run.product()
    assert "(5 clips are affected)" in run.err
    assert (len(measured), len(pools)) == (1, 0)
    alone = [(tmp_path / f"c{i}.npz").read_bytes() for i in range(5)]
    monkeypatch.setattr(chunk_pipeline, "MAX_VERTICES_ALONE", 0)
    call("bake", tmp_path / "in.glb", tmp_path / "{clip}.npz", "--fps", "2").product()
    assert len(pools) > 0
    assert [(tmp_path / f"c{i}.npz").read_bytes() for i in range(5)] == alone


def test_collapse_compares_equal_clips_once_and_bakes_each_method_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = json.loads(many.skins(1)[20:].rstrip(b"\0 "))
    clips = [{**document["animations"][0], "name": f"c{i}"} for i in range(5)]
    (tmp_path / "in.gltf").write_bytes(text({**document, "animations": clips}))
    bakes = count_calls(monkeypatch, Baker, "bake")
    found = call("collapse", tmp_path / "in.gltf", "--format", "json").json["clips"]
    assert len(bakes) == 2  # lbs, dqs
    assert [each["clip"] for each in found] == [f"c{i}" for i in range(5)]
    assert len({json.dumps(each["meshes"]) for each in found}) == 1


def morphing_clips(count: int) -> bytes:
    """Equal clips of a node with a morphing mesh, which is baked."""
    document = json.loads(many.clips_equal(count)[20:].rstrip(b"\0 "))
    targets = {**many.MESH["primitives"][0], "targets": [{"POSITION": 2}]}
    return text({**document, "meshes": [{"primitives": [targets], "weights": [0.5]}]})


def test_accessors_that_clips_share_are_described_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond them each clip has its own JSON only."""
    (tmp_path / "in.gltf").write_bytes(equal_clips(CLIPS))
    counted = count_calls(monkeypatch, storage_cost, "_text")
    report = call("inspect", tmp_path / "in.gltf", "--format", "json").json["files"][0]
    assert len(counted) < CLIPS + 10
    costs = [each["json_bytes"] for each in report["clips"]]
    shared = report["clips"][0]["json_bytes"] * CLIPS - report["animation_json_bytes"]
    assert costs[0] < costs[-1] == costs[0] + len("c299") - len("c0")
    assert shared > 0


def test_the_frame_rate_of_shared_times_is_estimated_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(many.clips_different(30))
    estimates = count_calls(monkeypatch, frame_rate, "estimate_frame_rate")
    report = json.loads(call("inspect", tmp_path / "in.glb", "--format", "json").product())
    assert [clip["frame_rate_fps"] for clip in report["files"][0]["clips"]] == [2] * 30
    assert len(estimates) == 2  # another one for the last frames of loops


def test_the_source_of_textures_is_prepared_once_for_all_clips(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its animations are left out at once, not from each file: that took time in proportion to the square."""
    (tmp_path / "in.glb").write_bytes(many.clips_different(4))
    alone = [tmp_path / f"alone{i}.png" for i in range(4)]
    for i, path in enumerate(alone):
        call("bake", tmp_path / "in.glb", path, "--rigid", "--fps", "4", "--clip", f"#{i}").product()
    prepared = count_calls(monkeypatch, bake_source_options, "prepare_source")
    call("bake", tmp_path / "in.glb", tmp_path / "{clip}.png", "--rigid", "--fps", "4").product()
    assert len(prepared) == 1
    for i, path in enumerate(alone):
        mesh = Path(f"{path}-mesh.glb").read_bytes()
        assert (tmp_path / f"c{i}.png-mesh.glb").read_bytes() == mesh
        assert "animations" not in opened(mesh).json


def test_each_file_of_a_clip_is_made_from_a_document_without_the_others(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that is gone through for a file, which was every clip: the references of documents, counted in values."""

    def values(clips: int) -> int:
        (tmp_path / "in.glb").write_bytes(many.clips_different(clips))
        with monkeypatch.context() as patch:
            counted = count_calls(patch, unknown_extensions, "_collect_unknown")
            call("bake", tmp_path / "in.glb", tmp_path / "{clip}.glb", "--rigid").product()
        return len(counted)

    few, twice = values(16), values(32)
    assert twice < 2.4 * few  # N log N: 2.25 times; the square would be 4 times


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_files_of_clips_are_those_of_a_source_with_one_clip(suffix: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / "in.glb").write_bytes(many.clips_different(5))
    call("bake", tmp_path / "in.glb", tmp_path / f"{{clip}}.{suffix}", "--rigid").product()
    for i in range(5):
        (tmp_path / "one").mkdir(exist_ok=True)
        call("bake", tmp_path / "in.glb", tmp_path / "one" / f"c{i}.{suffix}", "--rigid", "--clip", f"#{i}").product()
        assert (tmp_path / f"c{i}.{suffix}").read_bytes() == (tmp_path / "one" / f"c{i}.{suffix}").read_bytes()
