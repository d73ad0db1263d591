"""Small inputs with numbers beyond all bounds: digits by thousands, values of another width."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import anim
from anim.caches.child_process import ChildEndedError
from anim.caches.formats import usd_reader
from anim.errors import NotFoundError
from anim.exchange.retarget import retarget
from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal
from tests.fixtures.reading import split
from tests.fuzz.simulation_seeds import pack

DIGITS = "9" * 5000


@pytest.mark.parametrize("pointer", ["/meshes/0/weights/0", f"/meshes/0/weights/{DIGITS}", f"/nodes/{DIGITS}/weights"])
@pytest.mark.parametrize("line", ["plot", "convert", "bake"])
def test_pointers_to_weights_with_values_of_a_rotation(line: str, pointer: str, call: Call, tmp_path: Path) -> None:
    document, blob = split(built("arm"))
    clip = document["animations"][0]
    sampler = next(each["sampler"] for each in clip["channels"] if each["target"]["path"] == "rotation")
    target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}
    clip["channels"].append({"sampler": sampler, "target": target})
    document["extensionsUsed"] = ["KHR_animation_pointer"]
    (tmp_path / "in.glb").write_bytes(pack(document, blob))
    output = {"plot": "out.svg", "convert": "out.gltf", "bake": "out.npz"}[line]
    run = call(line, tmp_path / "in.glb", tmp_path / output, *(["--clip", "#0"] if line != "convert" else []))
    assert run.code in (0, 3), run.err
    assert "Traceback" not in run.err


@pytest.mark.parametrize("pointer", ["/nodes", "/nodes/x", f"/nodes/{DIGITS}/extensions/KHR_node_visibility/visible"])
def test_flip_books_with_pointers_to_nothing(pointer: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / "in.glb").write_bytes(built("arm"))
    line = ("--layout", "flip-visibility", "--fps", "4", "--clip", "#0")
    call("bake", tmp_path / "in.glb", tmp_path / "book.gltf", *line).product()
    document = json.loads((tmp_path / "book.gltf").read_text())
    for channel in document["animations"][0]["channels"]:
        channel["target"]["extensions"]["KHR_animation_pointer"]["pointer"] = pointer
    (tmp_path / "book.gltf").write_text(json.dumps(document))
    run = call("convert-cache", tmp_path / "book.gltf", tmp_path / "out.npz")
    assert run.code in (0, 3), run.err
    assert "Traceback" not in run.err


def test_a_clip_index_of_thousands_of_digits_is_no_clip(tmp_path: Path) -> None:
    (tmp_path / "in.glb").write_bytes(built("arm"))
    with pytest.raises(NotFoundError):
        anim.load(tmp_path / "in.glb").clips[f"#{DIGITS}"]


USDA = """#usda 1.0
(
    timeCodesPerSecond = RATE
)
def Mesh "m"
{
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points.timeSamples = { 0: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], 24: [(0, 0, 1), (1, 0, 0), (0, 1, 0)] }
}
"""


@pytest.mark.parametrize("rate", ["0", "-1", "inf"])
def test_usd_with_an_odd_rate_is_refused(rate: str, call: Call, tmp_path: Path) -> None:
    """usd-core computes without an end at 0 time codes per second."""
    pytest.importorskip("pxr")
    (tmp_path / "in.usda").write_text(USDA.replace("RATE", rate))
    assert "time codes per second" in refusal(call("convert-cache", tmp_path / "in.usda", tmp_path / "out.npz"), 3)


def doubled(levels: int) -> str:
    """A layer with prims that refer twice to the one before: 2**levels + 1 meshes."""
    prims = [USDA.replace("RATE", "24")]
    for i in range(1, levels + 1):
        before = "m" if i == 1 else f"c{i - 1}"
        two = f'def "a" (references = </{before}>) {{}}\ndef "b" (inherits = </{before}>) {{}}'
        prims.append(f'class Xform "c{i}"\n{{\n{two}\n}}\n')
    return "".join(prims) + f'def Xform "top" (references = </c{levels}>) {{}}\n'


def test_references_of_a_layer_to_itself_are_counted(call: Call, tmp_path: Path) -> None:
    """Half a million meshes of 2 kB took 13 s, and ended as a crash."""
    pytest.importorskip("pxr")
    (tmp_path / "in.usda").write_text(doubled(3))
    assert "27 vertices" in call("convert-cache", tmp_path / "in.usda", tmp_path / "out.npz").err
    (tmp_path / "in.usda").write_text(doubled(40))
    problem = refusal(call("convert-cache", tmp_path / "in.usda", tmp_path / "out.npz"), 4)
    assert "prims or more by its references to itself, which would take" in problem


@pytest.mark.parametrize(("peak", "code"), [(0, 3), (10**8, 3), (10**9, 4)])
def test_usd_core_that_ends_by_the_memory_limit(
    peak: int, code: int, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def ended(*_: object, **__: object) -> Iterator[Iterator[int]]:
        raise ChildEndedError(peak)
        yield iter(())

    monkeypatch.setattr(usd_reader, "run_in_child", ended)
    (tmp_path / "in.usda").write_text(USDA.replace("RATE", "24"))
    problem = refusal(call("convert-cache", tmp_path / "in.usda", tmp_path / "out.npz"), code)
    assert ("needs more than 1 GB of memory" if code == 4 else "crashed") in problem


def test_a_model_without_a_size_for_particles(call: Call, tmp_path: Path) -> None:
    """No option of the user is to blame, and one helps."""
    document, blob = split(built("arm"))
    for node in document["nodes"]:
        node["scale"] = [0, 0, 0]
    (tmp_path / "in.glb").write_bytes(pack(document, blob))
    line = ("simulate", "particles", tmp_path / "in.glb", tmp_path / "out.glb", "--node", "#0", "--clip", "#0")
    run = call(*line)
    assert "--size is 0.5% of the model, whose diagonal is 0 m (expected " in refusal(run, 3)
    assert "choose --size" in run.err


@pytest.mark.parametrize("size", ["1e308%", "1e-40%", "1e31", "1e-31m"])
def test_sizes_of_particles_that_an_option_is_to_blame_for(size: str, fixture: Fixture, call: Call) -> None:
    run = call("simulate", "particles", fixture("arm"), "-", "--node", "#0", "--clip", "#0", "--size", size)
    assert "--size is " in refusal(run, 2)


def test_a_tolerance_of_easings_that_exceeds_all_numbers(call: Call, tmp_path: Path) -> None:
    """Times the range of 90 m; the clip was to blame for it."""
    joint = "ROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nEnd Site\n{\nOFFSET 0 1 0\n}\n}"
    (tmp_path / "in.bvh").write_text(f"HIERARCHY\n{joint}\nMOTION\nFrames: 2\nFrame Time: 1\n0 0 0\n9000 0 0\n")
    call("from-euler", tmp_path / "in.bvh", tmp_path / "in.glb").product()
    line = ("ease", tmp_path / "in.glb", tmp_path / "out.glb", "--per", "range", "--tolerance")
    assert "--tolerance is '1e308' (expected at most " in refusal(call(*line, "1e308"), 2)
    call(*line, "1e6").product()


def test_springs_of_a_file_without_a_clip_take_two_seconds(call: Call, tmp_path: Path) -> None:
    """They were refused; other simulations take as long."""
    document, blob = split(built("arm"))
    del document["animations"]
    (tmp_path / "in.glb").write_bytes(pack(document, blob))
    line = ("simulate", "springs", tmp_path / "in.glb", tmp_path / "out.glb", "--chain", "#0")
    for options, seconds in (((), 2), (("--duration", "0.5"), 0.5)):
        run = call(*line, *options)
        run.product()
        assert f"{seconds} s in steps of 1/60 s" in run.err
    assert "or 2 without a clip" in " ".join(call("simulate", "springs", "--help").text.split())


@pytest.mark.parametrize("names", [["E\u202e" * 2000], [f"EXT_{i}" for i in range(40_000)]], ids=["long", "many"])
def test_names_in_messages_are_cut_as_they_are_shown(names: list[str], call: Call, tmp_path: Path) -> None:
    """A note had 3200 characters, since every escape is six of them, and was a list of 1000 characters."""
    document, blob = split(built("arm"))
    document["extensionsRequired"] = document["extensionsUsed"] = names
    (tmp_path / "in.glb").write_bytes(pack(document, blob))
    run = call("retime", tmp_path / "in.glb", tmp_path / "out.glb", "--speed", "2")
    (note,) = (line for line in run.err.splitlines() if "requires" in line)
    assert len(note.removeprefix(f"note: {tmp_path / 'in.glb'}: ")) < 400


def spinning(turns: dict[str, float]) -> str:
    """Curves of two keys a second apart for each axis of a joint that the fixture `arm` has. turns: at the end."""
    curves = {axis: {"times": [0, 1], "values": [0, 360 * number]} for axis, number in turns.items()}
    about = {"schema": "euler-curves/1", "order": "XYZ", "frame": "extrinsic", "unit": "deg", "meters_per_unit": 1}
    nodes = [{"name": "upper"}, {"name": "lower", "parent": "upper", "translation": [0, 1, 0], "curves": curves}]
    return json.dumps({**about, "nodes": nodes})


@pytest.mark.parametrize("onto", [False, True])
def test_keys_are_limited_by_those_of_the_source(onto: bool, call: Call, tmp_path: Path) -> None:
    """Four keys of 320 bytes became 444 172, in 5 s."""
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    line = ("from-euler", tmp_path / "in.json", tmp_path / "out.glb", *(["--onto", tmp_path / "arm.glb"] * onto))
    (tmp_path / "in.json").write_text(spinning({"rotation.x": 5555, "rotation.y": 5833}))
    run = call(*line)
    assert "node 'lower': the motion needs over 100000 keys" in refusal(run, 4)
    assert "--keys grid adds none" in run.err
    (tmp_path / "in.json").write_text(spinning({"rotation.x": 5555}))
    assert call(*line[:3]).code == 0


def test_poses_of_a_transfer_are_those_of_any_block(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """500 joints took 1.6 GB, for the poses of all segments at once."""
    (tmp_path / "in.glb").write_bytes(built("biped"))
    call("to-euler", tmp_path / "in.glb", tmp_path / "in.bvh", "--clip", "#0", "--fps", "10").product()
    line = ("from-euler", tmp_path / "in.bvh", "-", "--keys", "adaptive", "--onto", tmp_path / "in.glb")
    expected = call(*line).product()
    monkeypatch.setattr(retarget, "BLOCK_MATRICES", 1)
    assert call(*line).product() == expected
