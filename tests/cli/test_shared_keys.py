"""Keys that many tracks of a small file share, or that overlap, count with the work on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim import memory
from anim.gltf.document import Buffer
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.gltf.reading.overlaps import unbacked_bytes
from anim.gltf.reading.repeated_keys import count_repeated_keys
from anim.model import Clip
from fixtures.broken.pieces import buffered, text
from tests.cli.conftest import Call
from tests.cli.running import refusal


def of_animation(count: int, keys: int, *, shared: bool) -> bytes:
    """Translations of `count` nodes, each by an accessor of its own: of one view, or without data."""
    arrays = buffered(("SCALAR", 5126, np.arange(keys) / 30), ("VEC3", 5126, np.zeros((keys, 3))))
    output = arrays["accessors"][1] if shared else {"componentType": 5126, "count": keys, "type": "VEC3"}
    samplers = [{"input": 0, "output": 2 + i} for i in range(count)]
    channels = [{"sampler": i, "target": {"node": i, "path": "translation"}} for i in range(count)]
    return text(
        {
            "scenes": [{"nodes": list(range(count))}],
            "nodes": [{}] * count,
            **arrays,
            "accessors": [*arrays["accessors"], *[output] * count],
            "animations": [{"samplers": samplers, "channels": channels}],
        }
    )


@pytest.mark.parametrize("line", ["resample IN out.glb --fps 5", "optimize IN out.glb", "inspect IN", "check IN"])
@pytest.mark.parametrize(("count", "keys", "shared"), [(200, 500_000, False), (2000, 50_000, True)])
def test_outputs_of_an_animation_count_in_all(
    count: int, keys: int, shared: bool, line: str, call: Call, tmp_path: Path
) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(of_animation(count, keys, shared=shared))
    names = {"IN": path, "out.glb": tmp_path / "out.glb"}
    run = call(*(names.get(word, word) for word in line.split()))
    said, advice = run.err.splitlines()[-2:]  # after what is readable, of inspect and check
    assert (run.code, advice) == (4, "help: raise --memory-limit, or split the file")
    assert "would take" in said
    assert list(tmp_path.iterdir()) == [path]


def of_copies(nodes: int, keys: int, *, clips: int = 1, moves: bool = True) -> bytes:
    """Translations of `nodes` nodes by one pair of accessors, in each of some equal clips."""
    values = np.random.default_rng(0).normal(size=(keys, 3)) if moves else np.ones((keys, 3))
    arrays = buffered(("SCALAR", 5126, np.arange(keys) / 30), ("VEC3", 5126, values))
    channels = [{"sampler": 0, "target": {"node": i, "path": "translation"}} for i in range(nodes)]
    animation = {"samplers": [{"input": 0, "output": 1}], "channels": channels}
    return text(
        {
            "scenes": [{"nodes": list(range(nodes))}],
            "nodes": [{}] * nodes,
            **arrays,
            "animations": [animation] * clips,
        }
    )


EDITS = ["resample IN out.glb --fps 5", "spline IN out.glb", "ease IN out.glb --ease ease-in", "to-euler IN out.json"]


@pytest.mark.parametrize("line", EDITS)
def test_moving_keys_of_many_nodes_count(line: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(of_copies(201, 22_000))
    words = [{"IN": path}.get(word, tmp_path / word if word.startswith("out") else word) for word in line.split()]
    assert "work on keys that many tracks share would take 1.1 GB" in refusal(call(*words), 4)


@pytest.mark.parametrize(
    ("data", "count"),
    [(of_copies(201, 7000), 1_400_000), (of_copies(201, 7000, moves=False), 0), (of_copies(3, 7000, clips=99), 14_000)],
    ids=["moving", "constant", "clips"],
)
def test_keys_count_for_each_node_that_they_move(data: bytes, count: int) -> None:
    with memory.memory_limit(10**10):
        clips = reader.clips(container.read(np.frombuffer(data, np.uint8)))
    assert count_repeated_keys(clips) == count


def test_clips_that_differ_count_each() -> None:
    with memory.memory_limit(10**10):
        (clip,) = reader.clips(container.read(np.frombuffer(of_copies(4, 10), np.uint8)))
    some = [Clip("", clip.tracks[i : i + 2]) for i in range(3)]
    assert count_repeated_keys([*some, Clip("again", some[0].tracks)]) == 50


@pytest.mark.parametrize("line", ["resample IN out.glb --fps 5", "inspect IN", "spline IN out.glb"])
def test_keys_that_overlap_count_with_the_work_on_them(line: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(of_animation(200, 7000, shared=True))
    run = call(*({"IN": path, "out.glb": tmp_path / "out.glb"}.get(word, word) for word in line.split()))
    assert run.code == 4
    assert "keys of accessors that overlap, or have no data, would take 1.07 GB" in run.err


def test_accessors_beside_each_other_do_not_overlap() -> None:
    views = [{"buffer": 0, "byteLength": 120}, {"buffer": 0, "byteOffset": 120, "byteLength": 60}]
    about = {"componentType": 5126, "type": "VEC3"}
    first, second = {"bufferView": 0, "count": 10, **about}, {"bufferView": 1, "count": 5, **about}
    buffers = [Buffer(180, None, None)]
    assert unbacked_bytes([first, second], views, buffers) == 0
    assert unbacked_bytes([first, second, first], views, buffers) == 8 * 30
    assert unbacked_bytes([first, {"count": 7, **about}], views, buffers) == 8 * 21
