"""`optimize --meshopt` of more morph targets than fit a row of the codec (64)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.caches.options import WriteOptions
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.accessors import Accessors
from anim.gltf.validation import buffer_layout
from anim.model.vertex_cache import from_arrays
from tests.anim.caches.making import written
from tests.anim.gltf.meshopt.packing import found_by_three
from tests.cli.comparing import apart
from tests.cli.conftest import Call
from tests.files import glb_of, mark_slow, opened, opened_path
from tests.judge import needs_judge
from tests.khronos import errors, needs_validator, validate

EXTENSIONS = {"ext": "EXT_meshopt_compression", "khr": "KHR_meshopt_compression"}
BOUND = "0.05%"


@needs_judge
@needs_validator
@pytest.mark.parametrize("pointer", [False, True], ids=["weights", "pointer"])
@pytest.mark.parametrize("mode", EXTENSIONS)
@pytest.mark.parametrize("count", mark_slow([65, 128], slow=[128]))
def test_more_targets_than_a_row_holds(count: int, mode: str, pointer: bool, tmp_path: Path, call: Call) -> None:
    """Streams are valid, small, and three.js decodes the numbers that we do."""
    source, out = tmp_path / "face.glb", tmp_path / "small.glb"
    source.write_bytes(_face(count, pointer=pointer))
    run = call("optimize", source, out, "--meshopt", mode, "--max-error", BOUND, "--effort", "fast")
    assert run.code == 0, run.err
    document = opened_path(out)
    strides = [each["byteStride"] for each in _streams(document)]
    assert strides
    assert all(stride <= 256 and stride % 4 == 0 for stride in strides)
    assert out.stat().st_size < source.stat().st_size
    assert errors(validate(out.read_bytes())) == []
    for number, theirs in found_by_three(document, tmp_path).items():
        mine = Accessors(document).raw(number).ravel()
        np.testing.assert_array_equal(mine, theirs.astype(mine.dtype))
    found = apart(call, source, out)
    assert max(each["max_error_m"] for each in found["clips"]) <= 5e-4 * found["diagonal_m"] * (1 + 1e-6)
    again = call("optimize", out, tmp_path / "again.glb", "--meshopt", mode, "--max-error", BOUND, "--effort", "fast")
    assert again.code == 0
    assert (tmp_path / "again.glb").read_bytes() == out.read_bytes()


def _streams(document: Document) -> list[Json]:
    return [each for view in json_array(document.json, "bufferViews") if (each := buffer_layout.compression(view))]


def _face(count: int, *, pointer: bool) -> bytes:
    """A clip in which all weights of a mesh move, by a weights track or by a pointer to them."""
    random = np.random.default_rng(count)
    frames = np.cumsum(random.normal(size=(count + 1, 60, 3)), axis=0)
    cache = from_arrays(np.arange(count + 1) / 30, frames, np.arange(60).reshape(-1, 3))
    data = written(cache, "a.glb", WriteOptions(max_error=1e-4))[0].files["a.glb"]
    document = opened(data)
    assert len(document.json["meshes"][0]["weights"]) == count
    if pointer:
        (channel,) = document.json["animations"][0]["channels"]
        aim = {"KHR_animation_pointer": {"pointer": "/nodes/0/weights"}}
        channel["target"] = {"path": "pointer", "extensions": aim}
        document.json["extensionsUsed"] = ["KHR_animation_pointer"]
    return glb_of(document)
