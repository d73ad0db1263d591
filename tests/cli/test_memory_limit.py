"""Decoded data is counted before it is allocated: a small file can't take the machine's memory."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from anim import memory
from anim.errors import UnsupportedError
from anim.gltf.meshopt import codec
from anim.gltf.reading.accessors import Accessors
from fixtures.broken.pieces import buffered, data_uri, text
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.cli.running import ENVIRONMENT, ROOT, help_line, refusal


def targets(count: int, vertices: int) -> bytes:
    """A mesh of `count` morph targets, all of one accessor without data."""
    weights = [0.0] * count
    return text(
        {
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "accessors": [{"componentType": 5126, "count": vertices, "type": "VEC3"}],
            "meshes": [
                {
                    "primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}] * count}],
                    "weights": weights,
                }
            ],
        }
    )


def compressed_views(count: int) -> bytes:
    """Primitives over `count` meshopt views of one stream of zeros."""
    rows = np.zeros((16384, 256), np.uint8)
    stream = codec.encode(rows, "EXT_meshopt_compression")
    packed = {
        "buffer": 0,
        "byteLength": len(stream),
        "byteStride": 256,
        "count": len(rows),
        "mode": "ATTRIBUTES",
    }
    view = {"buffer": 1, "byteLength": rows.size, "extensions": {"EXT_meshopt_compression": packed}}
    vertices = rows.size // 12
    return text(
        {
            "extensionsUsed": ["EXT_meshopt_compression"],
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "buffers": [
                {"byteLength": len(stream), "uri": data_uri(stream)},
                {"byteLength": rows.size, "extensions": {"EXT_meshopt_compression": {"fallback": True}}},
            ],
            "bufferViews": [view] * count,
            "accessors": [
                {"bufferView": i, "componentType": 5126, "count": vertices, "type": "VEC3"} for i in range(count)
            ],
            "meshes": [{"primitives": [{"attributes": {"POSITION": i}} for i in range(count)]}],
        }
    )


def of_joints(count: int) -> bytes:
    """A skin of two nodes over and over."""
    weights = ("VEC4", 5126, np.tile([1, 0, 0, 0], (3, 1)))
    arrays = buffered(("VEC3", 5126, np.eye(3)), ("VEC4", 5123, np.zeros((3, 4))), weights, ("SCALAR", 5126, [0, 1]))
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    animation = {"samplers": [{"input": 3, "output": 0}], "channels": []}
    return text(
        {
            "scenes": [{"nodes": [0, 2]}],
            "nodes": [{"children": [1]}, {}, {"mesh": 0, "skin": 0}],
            "skins": [{"joints": [0, 1] * (count // 2)}],
            **arrays,
            "meshes": [{"primitives": [{"attributes": attributes}]}],
            "animations": [animation],
        }
    )


def of_instances(count: int, vertices: int, *, skinned: bool) -> bytes:
    """One mesh on `count` nodes."""
    weights = ("VEC4", 5126, np.tile([1, 0, 0, 0], (vertices, 1)))
    arrays = buffered(
        ("VEC3", 5126, np.random.default_rng(0).normal(size=(vertices, 3))),
        ("VEC4", 5123, np.zeros((vertices, 4))),
        weights,
        ("SCALAR", 5126, [0, 1]),
        ("VEC3", 5126, np.eye(3)[:2]),
    )
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    node = {"mesh": 0, "skin": 0} if skinned else {"mesh": 0}
    return text(
        {
            "scenes": [{"nodes": list(range(count + 1))}],
            "nodes": [{}] + [node] * count,
            "skins": [{"joints": [0]}],
            **arrays,
            "meshes": [{"primitives": [{"attributes": attributes}]}],
            "animations": [{"samplers": [{"input": 3, "output": 4}], "channels": [channel]}],
        }
    )


@pytest.mark.parametrize("skinned", [True, False])
@pytest.mark.parametrize("line", ["optimize IN out.glb", "bake IN out.npz --rigid", "render IN out.png", "collapse IN"])
def test_vertices_of_all_instances_count(line: str, skinned: bool, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(of_instances(20_000, 2000, skinned=skinned))
    names = {"IN": path, "out.glb": tmp_path / "out.glb", "out.npz": tmp_path / "o.npz", "out.png": tmp_path / "o.png"}
    said = refusal(call(*(names.get(word, word) for word in line.split())), 4)
    assert "would take 24 GB or more (limit 1 GB)" in said
    assert list(tmp_path.iterdir()) == [path]


def test_morph_targets_of_all_instances_count(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    content = json.loads(targets(200, 3))
    content["nodes"] = [{"mesh": 0}] * 700
    content["scenes"] = [{"nodes": list(range(700))}]
    path.write_bytes(text(content))
    said = refusal(call("bake", path, tmp_path / "out.npz", "--rigid"), 4)
    assert "140000 morph targets of all instances of meshes would take 1.12 GB or more" in said
    content["nodes"] = [{"mesh": 0}] * 600
    content["scenes"] = [{"nodes": list(range(600))}]
    path.write_bytes(text(content))
    call("bake", path, tmp_path / "out.npz", "--rigid").product()


def test_what_measures_at_nodes_then_says_so(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(of_instances(20_000, 2000, skinned=True))
    assert "vertices-unread" in call("inspect", path).text
    said = call("loop", path, tmp_path / "out.glb", "--blend", "0.1").err
    assert "measured at nodes, not on the surface" in said
    assert "(raise --memory-limit, or split the file)" in said


def test_frames_of_a_picture_count(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(of_instances(10, 2000, skinned=True))
    line = ["render", path, tmp_path / "out.png", "--size", "64", "--memory-limit", "13MB", "--frames"]
    call(*line, "4").product()
    assert "would take" in refusal(call(*line, "100"), 4)


@pytest.mark.parametrize("line", [["bake", "out.npz", "--fps", "4"], ["render", "out.png"]], ids=lambda line: line[0])
def test_joints_of_a_skin_count(line: list[str], call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(of_joints(300_000))
    command, out, *options = line
    assert "would take" in refusal(call(command, path, tmp_path / out, *options), 4)


@pytest.mark.parametrize(
    "data",
    [targets(30, 2_000_000), targets(300, 2_000_000), compressed_views(300)],
    ids=["few targets", "targets", "meshopt"],
)
@pytest.mark.parametrize("line", [["bake", "--rigid", "out.npz"], ["render", "out.png"]])
def test_decoded_data_of_a_small_file_has_a_limit(data: bytes, line: list[str], call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(data)
    command, *options, out = line
    run = call(command, path, tmp_path / out, *options)
    assert "would take" in refusal(run, 4)
    assert "(limit 1 GB)" in run.err
    assert "--memory-limit" in help_line(run)
    assert list(tmp_path.iterdir()) == [path]


def test_a_page_counts_all_meshes_before_it_reads_one(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.gltf").write_bytes(compressed_views(300))
    counted = count_calls(monkeypatch, Accessors, "floats")
    assert "would take" in refusal(call("view", tmp_path / "a.gltf", "-o", tmp_path / "out.html"), 4)
    assert not counted


def test_the_limit_can_be_chosen(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(targets(3, 10_000))
    line = ("bake", path, tmp_path / "out.npz")
    assert "(limit 1e-06 GB)" in refusal(call(*line, "--memory-limit", "1kB"), 4)
    call(*line, "--memory-limit", "100MB").product()
    assert "--memory-limit is '0'" in refusal(call(*line, "--memory-limit", "0"), 2)
    assert memory.limit_for(0) == 10**9
    assert memory.limit_for(10**9) == 64 * 10**9


def test_the_sum_counts() -> None:
    budget = memory.MemoryBudget(0)
    budget.add(6 * 10**8)
    with pytest.raises(UnsupportedError, match=r"would take 1\.2 GB or more \(limit 1 GB\)"):
        budget.add(6 * 10**8)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="only Linux has this limit")
def test_allocations_of_native_packages_have_a_limit() -> None:
    code = """
import numpy as np, os
from anim.memory import limit_allocations
size = 10**9 + 2**24 * os.cpu_count()
with limit_allocations(10**8):
    try: np.empty(size, np.uint8)
    except MemoryError: print("refused")
print(len(np.empty(size, np.uint8)) == size)
"""
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=True)
    assert run.stdout == b"refused\nTrue\n"
