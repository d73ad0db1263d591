"""Files of many nodes, clips and columns: time grows with their number, not with its square.

Work is the number of function calls, which no other process changes; work inside one call, as of numpy or `in`, is not
seen.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.gltf.reading import reader
from anim.maths import hierarchy
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.loops import loop_analysis
from anim.model import Clip, TimeAxis
from anim.optimization import optimize_clips
from anim.sampling.pose import PoseSampler
from anim.skinning.analysis import enclosed_volume, method_scores
from cli.workflows import mesh_pairs
from fixtures.broken.pieces import buffered, text
from tests import many
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.files import clips_of, opened_path

NODES = 2000, 6000
LIMIT = 5.0  # three times the nodes take three times the work, nine times if quadratic
CLIPS = 300
KEYS = buffered(("SCALAR", 5126, [0, 1]), ("VEC4", 5126, np.array([[0, 0, 0, 1], [0, 0, 0.7071068, 0.7071068]])))
CHANNEL = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
SAMPLERS = [{"input": 0, "output": 1}]


def chain(count: int) -> bytes:
    """Nodes one below the other, the first one animated."""
    nodes = [{"name": f"n{i}", "translation": [0, 0.1, 0], "children": [i + 1]} for i in range(count)]
    nodes[-1].pop("children")
    return text(
        {
            "scenes": [{"nodes": [0]}],
            "nodes": nodes,
            **KEYS,
            "animations": [{"name": "a", "samplers": SAMPLERS, "channels": [CHANNEL]}],
        }
    )


def equal_clips(count: int) -> bytes:
    """Clips with the same keys under different names."""
    clips = [{"name": f"c{i}", "samplers": SAMPLERS, "channels": [CHANNEL]} for i in range(count)]
    return text({"scenes": [{"nodes": [0]}], "nodes": [{"name": "n"}], **KEYS, "animations": clips})


def work(call: Call, *line: str | Path) -> int:
    """Return the number of function calls of a command that succeeds."""
    count = 0

    def called(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(called)
    try:
        run = call(*line)
    finally:
        sys.setprofile(None)
    run.product()
    return count


@pytest.mark.slow
@pytest.mark.parametrize("line", [["optimize", "OUT", "--effort", "fast", "--jobs", "1"], ["inspect"], ["diff", "IN"]])
def test_a_chain_of_nodes(line: list[str], call: Call, tmp_path: Path) -> None:
    taken = []
    for count in NODES:
        path = tmp_path / f"{count}.gltf"
        path.write_bytes(chain(count))
        names = {"OUT": str(tmp_path / "out.glb"), "IN": str(path)}
        taken.append(work(call, line[0], path, *(names.get(each, each) for each in line[1:])))
    assert taken[1] < LIMIT * taken[0]


@pytest.mark.parametrize(
    "line",
    [["diff", "OTHER"], ["resample", "OUT", "--fps", "5"], ["spline", "OUT", "--tangents", "catmull-rom"]],
    ids=lambda line: line[0],
)
def test_equal_clips_are_measured_once(
    line: list[str], call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(equal_clips(CLIPS))
    names = {"OUT": str(tmp_path / "out.glb"), "OTHER": str(tmp_path / "other.glb")}
    call("resample", path, names["OTHER"], "--fps", "7").product()
    counted = count_calls(monkeypatch, Prover, "certified")
    call(line[0], path, *(names.get(each, each) for each in line[1:])).product()
    assert len(counted) == 1


@pytest.mark.parametrize("options", [[], ["OUT", "--blend", "0.2"]], ids=["report", "blend"])
def test_equal_loops_are_analyzed_once(
    options: list[str], call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.gltf").write_bytes(equal_clips(CLIPS))
    counted = count_calls(monkeypatch, loop_analysis, "_loop")
    line = [str(tmp_path / "out.glb") if each == "OUT" else each for each in options]
    call("loop", tmp_path / "in.gltf", *line).product()
    assert len(counted) == 1


def test_equal_clips_are_optimized_once(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A third clip differs: it gets its own result, and every clip its own name."""
    steps = np.arange(6.0)
    line = np.stack((steps, 0 * steps, 0 * steps), axis=1)
    keys = buffered(("SCALAR", 5126, steps), ("VEC3", 5126, line), ("VEC3", 5126, line[:, ::-1]))
    channels = [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]
    outputs = [1, 1, 2, 1]
    clips = [
        {"name": f"c{i}", "samplers": [{"input": 0, "output": output}], "channels": channels}
        for i, output in enumerate(outputs)
    ]
    path = tmp_path / "in.gltf"
    path.write_bytes(text({"nodes": [{"name": "n"}], **keys, "animations": clips}))
    counted = count_calls(monkeypatch, optimize_clips, "_optimize")
    call("optimize", path, tmp_path / "out.glb", "--max-error", "1mm", "--jobs", "1").product()
    assert len(counted) == 2
    found = clips_of((tmp_path / "out.glb").read_bytes())
    assert [(clip.name, len(clip.tracks[0].times)) for clip in found] == [(f"c{i}", 2) for i in range(4)]
    assert [clip.tracks[0].values[-1].tolist() for clip in found] == [[5, 0, 0], [5, 0, 0], [0, 0, 5], [5, 0, 0]]


@pytest.mark.slow
def test_a_plot_takes_the_span_of_a_clip_once(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is a search over all tracks: for each of them it would be quadratic."""
    pytest.importorskip("matplotlib")
    channels = [{"sampler": 0, "target": {"node": i, "path": "rotation"}} for i in range(CLIPS)]
    animation = {"name": "a", "samplers": SAMPLERS, "channels": channels}
    nodes = [{"name": f"n{i}"} for i in range(CLIPS)]
    (tmp_path / "in.gltf").write_bytes(text({"nodes": nodes, **KEYS, "animations": [animation]}))
    counted: list[None] = []
    time_axes = vars(Clip)["time_axes"].fget

    def called(clip: Clip) -> tuple[TimeAxis, ...]:
        counted.append(None)
        return tuple(time_axes(clip))

    monkeypatch.setattr(Clip, "time_axes", property(called))
    call("plot", tmp_path / "in.gltf", tmp_path / "out.png").product()
    assert len(counted) < 10


def test_every_equal_clip_is_changed_and_listed(call: Call, tmp_path: Path) -> None:
    (tmp_path / "in.gltf").write_bytes(equal_clips(3))
    call("resample", tmp_path / "in.gltf", tmp_path / "out.glb", "--fps", "5").product()
    clips = call("inspect", tmp_path / "out.glb", "--format", "json").json["files"][0]["clips"]
    assert [(each["name"], each["keys"]) for each in clips] == [("c0", 6), ("c1", 6), ("c2", 6)]
    report = call("diff", tmp_path / "in.gltf", tmp_path / "out.glb", "--format", "json").json
    assert [each["clip"] for each in report["clips"]] == ["c0", "c1", "c2"]


@pytest.mark.slow
def test_curves_whose_children_come_before_their_parents(call: Call, tmp_path: Path) -> None:
    (tmp_path / "arm.gltf").write_bytes(chain(2))
    call("to-euler", tmp_path / "arm.gltf", tmp_path / "a.json", "--clip", "a").product()
    about = json.loads((tmp_path / "a.json").read_text())
    node = {**about["nodes"][0], "parent": None}
    taken = []
    for count in NODES:
        nodes = [{**node, "name": f"n{i}", "parent": f"n{i - 1}" if i else None} for i in range(count)]
        (tmp_path / "a.json").write_text(json.dumps({**about, "nodes": nodes[::-1]}))
        taken.append(work(call, "from-euler", tmp_path / "a.json", tmp_path / "out.glb"))
    assert taken[1] < LIMIT * taken[0]


def test_a_deep_chain_of_moving_nodes_is_not_refined(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bounds of derivatives grow with the depth's square: samples between the frames would only take time."""
    counted = count_calls(monkeypatch, ErrorMetric, "posed")
    paths = []
    for count in (20, 300):
        (tmp_path / f"{count}.glb").write_bytes(many.chain_open(count))
        done = call("resample", tmp_path / f"{count}.glb", tmp_path / "out.glb", "--fps", "5")
        done.product()
        paths.append((len(counted), "max at least" in done.err))
        counted.clear()
    assert paths[0][0] > 0
    assert paths[1] == (0, True)


@pytest.mark.slow
def test_static_nodes_are_measured_as_one(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 3000 nodes one moves: world matrices are those of a few nodes, in every frame."""
    sizes: list[int] = []

    def called(local: Floats, parents: Ints, *more: Any, **options: Any) -> Floats:
        sizes.append(local.size // 12)
        return accumulate(local, parents, *more, **options)

    accumulate = hierarchy.accumulate
    monkeypatch.setattr(hierarchy, "accumulate", called)
    for make in (many.chain, many.side_meshes):
        (tmp_path / "in.glb").write_bytes(make(3000))
        call("resample", tmp_path / "in.glb", tmp_path / "other.glb", "--fps", "3").product()
        sizes.clear()
        call("diff", tmp_path / "in.glb", tmp_path / "other.glb").product()
        assert max(sizes) <= 3000
        assert sum(sizes) < 20 * 3000


def test_skins_are_reported_by_their_own_meshes(call: Call, tmp_path: Path) -> None:
    (tmp_path / "in.glb").write_bytes(many.skins(3))
    report = call("inspect", tmp_path / "in.glb", "--format", "json").json["files"][0]
    assert [(each["joints"], each["vertices"]) for each in report["skins"]] == [(2, 3)] * 3


def test_meshes_of_two_files_are_paired_by_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "in.glb").write_bytes(many.skins(100))
    scene = reader.scene(opened_path(tmp_path / "in.glb"))
    counted = count_calls(monkeypatch, mesh_pairs, "node_name")
    assert list(mesh_pairs.instance_pairs(scene, scene)) == [(i, i) for i in range(100)]
    assert len(counted) <= 2 * 100


def test_equal_skinned_meshes_are_compared_once(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "in.glb").write_bytes(many.skins(3))
    counted = count_calls(monkeypatch, method_scores, "_bind_measures")
    report = call("collapse", tmp_path / "in.glb", "--format", "json").json
    assert len(counted) == 1
    meshes = report["clips"][0]["meshes"]
    assert (report["skinned_meshes"], [each["mesh"] for each in meshes]) == (3, ["m0", "m1", "m2"])
    assert all({**each, "mesh": "", "node": 0} == {**meshes[0], "mesh": "", "node": 0} for each in meshes)


def test_closed_parts_are_found_once_for_skins_on_the_same_shape(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(many.skins_different(20))
    shapes = count_calls(monkeypatch, enclosed_volume, "watertight_faces")
    sizes = count_calls(monkeypatch, method_scores, "model_size")
    call("collapse", tmp_path / "in.glb").product()
    assert (len(shapes), len(sizes)) == (1, 2)  # the size by each of two methods


def test_skinned_meshes_share_the_poses_of_the_skeleton(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All nodes are posed once per frame, whatever the number of meshes."""
    sizes = []
    for count in (2, 6):
        (tmp_path / "in.glb").write_bytes(many.skins_different(count))
        counted = count_calls(monkeypatch, PoseSampler, "at_each")
        call("collapse", tmp_path / "in.glb").product()
        sizes.append(len(counted))
        monkeypatch.undo()
    assert sizes[0] == sizes[1] > 0


def test_a_scene_is_read_once_for_change_and_measure(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(many.side_meshes(3))
    counted = count_calls(monkeypatch, reader, "scene")
    call("loop", tmp_path / "in.glb", tmp_path / "out.glb", "--blend", "0.1").product()
    assert len(counted) == 1


def test_meshes_are_not_paired_where_none_can_be_a_bake(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(many.side_meshes(3))
    counted = count_calls(monkeypatch, mesh_pairs, "instance_pairs")
    call("diff", tmp_path / "in.glb", tmp_path / "in.glb").product()
    assert not counted
