"""Files of many nodes, clips and columns: time grows with their number, not with its square."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from fixtures.broken.pieces import buffered, text
from tests.cli.conftest import Call
from tests.cli.running import refusal

COUNTS = 500, 4000
LIMIT = 24.0  # 8 times the nodes take 8 times the CPU, 64 times if quadratic


def chain(count: int) -> bytes:
    """Nodes one below the other, the first one animated."""
    nodes = [{"name": f"n{i}", "translation": [0, 0.1, 0], "children": [i + 1]} for i in range(count)]
    nodes[-1].pop("children")
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    rotations: list[list[float]] = [[0, 0, 0, 1], [0, 0, 0.7071068, 0.7071068]]
    return text(
        {
            "scenes": [{"nodes": [0]}],
            "nodes": nodes,
            **buffered(("SCALAR", 5126, [0, 1]), ("VEC4", 5126, rotations)),
            "animations": [{"name": "a", "samplers": [{"input": 0, "output": 1}], "channels": [channel]}],
        }
    )


def seconds(call: Call, *line: str | Path) -> float:
    """CPU seconds of a command that succeeds."""
    began = time.process_time()
    call(*line).product()
    return time.process_time() - began


@pytest.mark.slow
@pytest.mark.parametrize("line", [["optimize", "OUT", "--effort", "fast", "--jobs", "1"], ["inspect"], ["diff", "IN"]])
def test_a_chain_of_nodes(line: list[str], call: Call, tmp_path: Path) -> None:
    taken = []
    for count in COUNTS:
        path = tmp_path / f"{count}.gltf"
        path.write_bytes(chain(count))
        names = {"OUT": str(tmp_path / "out.glb"), "IN": str(path)}
        taken.append(seconds(call, line[0], path, *(names.get(each, each) for each in line[1:])))
    assert taken[1] < LIMIT * taken[0]


def test_a_column_twice_among_many(call: Call, tmp_path: Path) -> None:
    header = ",".join(["time", *(f"n{i}.rx" for i in range(40_000)), "n39999.rx"])  # minutes if it were quadratic
    (tmp_path / "a.csv").write_text(f"{header}\n")
    line = ("--order", "XYZ", "--axes", "extrinsic", "--unit", "deg")
    said = refusal(call("from-euler", tmp_path / "a.csv", tmp_path / "out.glb", *line), 3)
    assert "column 'n39999.rx' twice" in said


@pytest.mark.slow
def test_curves_whose_children_come_before_their_parents(call: Call, tmp_path: Path) -> None:
    (tmp_path / "arm.gltf").write_bytes(chain(2))
    call("to-euler", tmp_path / "arm.gltf", tmp_path / "a.json", "--clip", "a").product()
    about = json.loads((tmp_path / "a.json").read_text())
    node = {**about["nodes"][0], "parent": None}
    taken = []
    for count in COUNTS:
        nodes = [{**node, "name": f"n{i}", "parent": f"n{i - 1}" if i else None} for i in range(count)]
        (tmp_path / "a.json").write_text(json.dumps({**about, "nodes": nodes[::-1]}))
        taken.append(seconds(call, "from-euler", tmp_path / "a.json", tmp_path / "out.glb"))
    assert taken[1] < LIMIT * taken[0]
