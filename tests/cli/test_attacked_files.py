"""Small files that once ended in a traceback, in silence: each is done or refused."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, refusal
from tests.fixtures.reading import split
from tests.fuzz.simulation_seeds import pack

ODD: list[Any] = [None, [], 5]
MATERIALS: list[dict[str, Any]] = [
    *({"pbrMetallicRoughness": each} for each in ODD),
    *({"pbrMetallicRoughness": {"baseColorFactor": each}} for each in (1, [1], ["x"])),
]


@pytest.mark.parametrize("index", [0, 7, "x"])
@pytest.mark.parametrize("material", MATERIALS, ids=str)
def test_odd_materials_are_drawn_or_refused(
    material: dict[str, Any], index: int | str, call: Call, tmp_path: Path
) -> None:
    document, blob = split(built("morph_cube"))
    document["materials"] = [material]
    document["meshes"][0]["primitives"][0]["material"] = index
    (tmp_path / "in.glb").write_bytes(pack(document, blob))
    run = call("render", tmp_path / "in.glb", tmp_path / "out.png", "--frames", "1", "--clip", "#0")
    assert run.code in (0, 3), run.err
    assert "Traceback" not in run.err


def test_faces_of_fractions_are_refused(call: Call, tmp_path: Path) -> None:
    data = io.BytesIO()
    np.savez(data, positions=np.zeros((1, 3, 3), np.float32), times=np.zeros(1), faces=np.array([[0, 1, 1.5]]))
    (tmp_path / "in.npz").write_bytes(data.getvalue())
    assert "faces" in refusal(call("convert-cache", tmp_path / "in.npz", tmp_path / "out.mdd"), 3)


@pytest.mark.parametrize("name", ["in.gltf", "in.json"])
def test_json_a_million_deep_is_named(name: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / name).write_text('{"a": ' + "[" * 10**6)
    line = ("inspect",) if name == "in.gltf" else ("from-euler",)
    assert name in refusal(call(*line, tmp_path / name, *([tmp_path / "out.glb"] * (name == "in.json"))), 3)
