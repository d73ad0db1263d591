"""The judge itself, before it judges: nothing is 0, known displacements have their closed form, `anim` agrees."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.measure.error.metric import SLACK, ErrorMetric
from anim.measure.error.sample_times import key_and_mid_times
from anim.measure.error.surface import place_points, surfaces
from anim.model import Clip, Scene
from anim.operations.resample import resample
from anim.sampling import sample_pose
from anim.sampling.world import world_by_node
from tests.clips import about, clip, track
from tests.files import glb_of, mark_slow, opened, opened_fixture, opened_path
from tests.judge import RATE, ClipVerdict, Verdict, judge, needs_judge

pytestmark = needs_judge

Find = Callable[[str], Path]
FLOAT32 = 1e-6  # three's interpolants hold float32: about 1e-7 of a value of order 1


@pytest.mark.parametrize("name", ["biped", "interpolations", "morph_cube", "tube"])
def test_a_file_is_where_it_is(name: str, tmp_path: Path) -> None:
    found = judge(*(_written(tmp_path, each, opened_fixture(name)) for each in "ab"))
    assert found.max_error == 0
    assert found.by_vertex
    assert found.clips
    assert (found.missing, found.extra, found.unmatched) == ((), (), ())


def test_another_container_moves_nothing(asset: Find) -> None:
    """The same scene as GLB, and as text with an external buffer."""
    assert judge(asset("CesiumMan.glb"), asset("CesiumMan-gltf/CesiumMan.gltf")).max_error == 0


# Closed forms


def test_a_moved_key_shows_as_it_moved(tmp_path: Path) -> None:
    document = opened_fixture("interpolations")
    found = _judged(tmp_path, document, 0, _shifted("linear_translation", "translation", key=1, by=[0.03, 0, 0.04]))
    worst = found.worst
    assert worst.max_error == pytest.approx(0.05, abs=FLOAT32)
    assert (worst.node, worst.time) == ("linear_translation", 0.5)


def test_a_turned_joint_moves_the_farthest_vertex_on_a_chord(tmp_path: Path) -> None:
    """The tube's last ring hangs wholly on the upper joint, half a metre above it and a decimetre beside it."""
    document = opened_fixture("tube_f03")
    found = _judged(tmp_path, document, _number(document, "bend90"), _turned(93))
    assert found.by_vertex
    assert found.worst.name == "bend90"
    assert found.max_error == pytest.approx(2 * np.hypot(0.5, 0.1) * np.sin(np.radians(1.5)), abs=FLOAT32)


def test_a_morph_weight_moves_by_its_delta(tmp_path: Path) -> None:
    """`lean` moves the upper edge, 1 m above the lower one, by half a metre."""
    document = opened_fixture("morph_cube")
    found = _judged(tmp_path, document, 0, _shifted("cube", "weights", key=1, by=[0, 0.2, 0]))
    assert found.worst.max_error == pytest.approx(0.2 * 0.5, abs=FLOAT32)
    assert found.worst.time == 0.5


def test_nodes_without_vertices_are_reported_by_themselves(tmp_path: Path) -> None:
    document = opened_fixture("interpolations")
    node = reader.skeleton(document).names.index("step_scale_place")
    place = reader.skeleton(document).translation[node]

    def change(before: Clip) -> Clip:
        raised = track("translation", [0], [np.add(place, [0, 0.01, 0])], node=node)
        return clip(*before.tracks, raised, name=before.name)

    found = _judged(tmp_path, document, 0, change).clips[0]
    assert found.bare_node == "step_scale_place"
    assert found.bare_error == pytest.approx(0.01, abs=FLOAT32)
    assert found.max_error == pytest.approx(0.01, abs=FLOAT32)


# Files that do not match


def test_other_vertices_give_way_to_the_truths_on_the_others_nodes(tmp_path: Path) -> None:
    document = opened_fixture("tube_f03")
    number = _number(document, "bend90")
    changed = writer.replace_clips(document, {number: _turned(93)(reader.clips(document)[number])})
    other = tmp_path / "other.glb"
    other.write_bytes(_with_larger_mesh(glb_of(changed)))
    found = judge(_written(tmp_path, "truth", document), other)
    assert not found.by_vertex
    assert found.max_error == pytest.approx(2 * np.hypot(0.5, 0.1) * np.sin(np.radians(1.5)), abs=FLOAT32)


def test_vertices_without_a_joint_to_hang_on_are_refused(tmp_path: Path) -> None:
    document = opened_fixture("tube_f03")
    nodes = [{**node, "name": "renamed"} if node["name"] == "upper" else node for node in document.json["nodes"]]
    other = tmp_path / "other.glb"
    other.write_bytes(_with_larger_mesh(glb_of(replace(document, json={**document.json, "nodes": nodes}))))
    with pytest.raises(RuntimeError, match=r"^other.glb: node \d 'upper' carries vertices and is not in"):
        judge(_written(tmp_path, "truth", document), other)


def test_clips_are_matched_by_name_then_by_order(tmp_path: Path) -> None:
    document = opened_fixture("tube")
    first, *rest = document.json["animations"]
    renamed = replace(document, json={**document.json, "animations": [*reversed(rest), {**first, "name": "new"}]})
    found = judge(*(_written(tmp_path, name, each) for name, each in [("truth", document), ("other", renamed)]))
    assert [each.other for each in found.clips] == ["new", *(each["name"] for each in rest)]
    assert found.max_error == 0


def test_a_missing_clip_is_named_and_counts_as_rest(tmp_path: Path) -> None:
    """Without `bend90` the tube stands straight: its last ring is a quarter turn away."""
    document = opened_fixture("tube_f03")
    kept = [each for each in document.json["animations"] if each["name"] != "bend90"]
    less = replace(document, json={**document.json, "animations": kept})
    truth, other = _written(tmp_path, "truth", document), _written(tmp_path, "other", less)
    found = judge(truth, other)
    assert found.missing == ("bend90",)
    assert found.worst.other is None
    assert found.max_error == pytest.approx(2 * np.hypot(0.5, 0.1) * np.sin(np.pi / 4), abs=FLOAT32)
    assert judge(other, truth).extra == ("bend90",)


def test_what_three_does_not_play_is_named(tmp_path: Path) -> None:
    document = opened_fixture("pointer")
    found = judge(_written(tmp_path, "a", document), _written(tmp_path, "b", document))
    assert "truth: turn: /nodes/0/rotation" in found.ignored
    assert len(found.ignored) == 2 * len(document.json["animations"])


def test_a_vertex_that_is_nowhere_is_refused(tmp_path: Path) -> None:
    document = opened_fixture("tube_f03")
    output = document.json["animations"][0]["samplers"][0]["output"]
    broken = tmp_path / "broken.glb"
    broken.write_bytes(_scaled(glb_of(document), output, np.nan))
    with pytest.raises(RuntimeError, match=r"^broken.glb: a vertex or node is nowhere"):
        judge(_written(tmp_path, "truth", document), broken)


def test_what_is_not_gltf_is_refused_in_threes_words(tmp_path: Path) -> None:
    (tmp_path / "no.glb").write_bytes(b"no")
    with pytest.raises(RuntimeError, match=r"^no.glb: .*JSON"):
        judge(_written(tmp_path, "truth", opened_fixture("tube")), tmp_path / "no.glb")


# Against our own ruler


@pytest.mark.parametrize("name", mark_slow(["Fox.glb", "CesiumMan.glb", "Robot.glb"]))
def test_our_ruler_and_three_agree_on_real_files(asset: Find, name: str, tmp_path: Path) -> None:
    """Where and when three finds the worst, `anim` does; and our ruler overstates it by no more than its slack."""
    document = opened_path(asset(name))
    before = reader.clips(document)
    changed = writer.replace_clips(document, {i: resample(each, fps=9) for i, each in enumerate(before)})
    found = judge(asset(name), _written(tmp_path, "other", changed))
    ruler = ErrorMetric(reader.scene(document))
    assert found.by_vertex
    assert len(found.clips) == len(before)
    assert found.diagonal == pytest.approx(ruler.diagonal, rel=1e-6)
    for each, old, new in zip(found.clips, before, reader.clips(changed), strict=True):
        assert each.max_error > 1e-3 * found.diagonal  # else nothing is compared
        assert _at_node(ruler.scene, each, old, new) == pytest.approx(each.max_error, abs=1e-6 * found.diagonal)
        times = np.union1d(np.arange(0, each.duration, 1 / RATE), key_and_mid_times(old, new)[::2])
        ours = ruler.error_at(old, new, times).max_error
        assert -1e-6 * found.diagonal <= ours - each.max_error <= (SLACK - 1) * ours + 1e-6 * found.diagonal


def _at_node(scene: Scene, found: ClipVerdict, before: Clip, after: Clip) -> float:
    """How far `anim` moves the farthest vertex of the node that three found worst, at its time."""
    moved = (_placed(scene, found, each) for each in (before, after))
    return max(float(np.linalg.norm(a - b, axis=1).max()) for a, b in zip(*moved, strict=True))


def _placed(scene: Scene, found: ClipVerdict, clip: Clip) -> list[Floats]:
    assert found.time is not None
    skeleton = scene.skeleton
    world = world_by_node(skeleton, sample_pose(skeleton, clip, np.array([found.time])))
    theirs = (each for each in surfaces(scene) if skeleton.names[each.owner] == found.node)
    return [place_points(each, world[each.nodes, 0], each.rest_weights) for each in theirs]


# Helpers


def _judged(folder: Path, document: Document, number: int, change: Callable[[Clip], Clip]) -> Verdict:
    changed = writer.replace_clips(document, {number: change(reader.clips(document)[number])})
    return judge(_written(folder, "truth", document), _written(folder, "other", changed))


def _written(folder: Path, name: str, document: Document) -> Path:
    path = folder / f"{name}.glb"
    path.write_bytes(glb_of(document))
    return path


def _number(document: Document, name: str) -> int:
    return reader.names(document).index(name)


def _shifted(node: str, path: str, *, key: int, by: list[float]) -> Callable[[Clip], Clip]:
    def change(before: Clip) -> Clip:
        tracks = list(before.tracks)
        place = next(i for i, each in enumerate(tracks) if each.path == path and each.interpolation.name == "LINEAR")
        values = tracks[place].values.copy()
        values[key] += by
        tracks[place] = replace(tracks[place], values=values)
        return replace(before, tracks=tuple(tracks))

    return change


def _turned(degrees: float) -> Callable[[Clip], Clip]:
    def change(before: Clip) -> Clip:
        (only,) = before.tracks
        return replace(before, tracks=(replace(only, values=about("x", [0, degrees])),))

    return change


def _with_larger_mesh(data: bytes) -> bytes:
    """The same file with all positions doubled: not the same vertices any more."""
    return _scaled(data, opened(data).json["meshes"][0]["primitives"][0]["attributes"]["POSITION"], 2)


def _scaled(data: bytes, accessor: int, factor: float) -> bytes:
    """The same file with the floats of one accessor multiplied where they stand; they must lie alone in their view."""
    content = opened(data).json
    view = content["bufferViews"][content["accessors"][accessor]["bufferView"]]
    start = 28 + int.from_bytes(data[12:16], "little") + view.get("byteOffset", 0)
    numbers = np.frombuffer(data, np.float32, view["byteLength"] // 4, start)
    return data[:start] + (np.float32(factor) * numbers).tobytes() + data[start + numbers.nbytes :]
