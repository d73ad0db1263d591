"""Files whose diagonal is 0, such as one camera: rotation and scale of their nodes are errors too."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import anim
from anim.gltf.reading import reader
from fixtures.document import Channel, add_clip, add_node, start
from tests.cli.conftest import Call
from tests.clips import about
from tests.files import opened_path

TIMES = np.linspace(0, 2, 21)
PAN = about("y", 86 * np.sin(TIMES))
GROWTH = np.repeat(1 + TIMES[:, None] ** 2, 3, axis=1)


@pytest.fixture(params=[1, 3], ids=["one node", "nodes at one place"])
def camera(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Nodes at the origin that turn and grow."""
    gltf = start()
    channels = []
    for i in range(request.param):
        node = add_node(gltf, f"camera{i}")
        channels += [Channel(node, "rotation", TIMES, PAN), Channel(node, "scale", TIMES, GROWTH)]
    add_clip(gltf, "pan", channels)
    path = tmp_path / "camera.glb"
    path.write_bytes(b"".join(gltf.save_to_bytes()))
    return path


@pytest.mark.parametrize("bound", ["1mm", "0.01%"])
def test_optimize_keeps_their_rotation(camera: Path, bound: str, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "small.glb"
    assert call("optimize", camera, out, "--max-error", bound).code == 0
    before, after = (reader.clips(opened_path(path))[0] for path in (camera, out))
    assert len(after.tracks) == len(before.tracks)
    assert call("diff", camera, out, "--fail-above", "1.5mm").code == 0
    found = json.loads(call("diff", camera, out, "--format", "json").out)
    assert found["clips"][0]["max_angle_deg"] < 6


def test_lost_rotation_fails_a_check(camera: Path, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "coarse.glb"
    run = call("resample", camera, out, "--fps", "0.1")
    assert run.code == 0
    assert "max 0 mm" not in run.err
    assert call("diff", camera, out, "--fail-above", "1mm").code == 6
    assert anim.diff(camera, out).max_error > 1e-3


def test_shares_of_a_size_that_is_zero_are_not_stated(camera: Path, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "coarse.glb"
    call("resample", camera, out, "--fps", "0.1")
    row = call("diff", camera, out).out.decode().splitlines()[1]
    assert " 0 " not in row
