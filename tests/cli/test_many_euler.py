"""Euler files of many nodes: work on all of them at once, counted by calls."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.curves.fitting import stacked_keys
from anim.exchange.euler import curve, from_euler, to_bvh_motion
from anim.exchange.euler.baked_keys import curves_of
from anim.exchange.euler.convention import PartialConvention
from anim.exchange.euler.motion import Unit
from anim.exchange.formats import csv_reader, json_reader
from anim.maths import euler
from anim.maths.euler import AxesConvention
from tests import many
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.cli.running import refusal
from tests.files import opened_path


@pytest.mark.parametrize(("make", "suffix"), [(many.json_curves, ".json"), (many.csv_columns, ".csv")])
def test_curves_of_many_nodes_are_fitted_at_once(
    make: many.Make, suffix: str, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fits = count_calls(monkeypatch, stacked_keys, "rotation_segment_count")
    alone = count_calls(monkeypatch, from_euler, "linear_keys")
    distances = count_calls(monkeypatch, euler, "gimbal_distance")
    (tmp_path / f"a{suffix}").write_bytes(make(600))
    convention = () if suffix == ".json" else ("--order", "XYZ", "--axes", "extrinsic", "--unit", "deg")
    call("from-euler", tmp_path / f"a{suffix}", tmp_path / "out.glb", *convention).product()
    assert 0 < len(fits) < 5
    assert not alone
    assert 0 < len(distances) <= 12


def test_columns_and_curves_with_equal_times_share_a_time_axis() -> None:
    """Of a column with a hole, and of a curve with other times, there is a second one."""
    intrinsic = PartialConvention("XYZ", AxesConvention.INTRINSIC, Unit.RAD)
    made = csv_reader.read(b"time,a.rx,a.ry,b.tx,b.ty\n0,1,2,3,4\n1,5,6,,7\n2,5,6, 8 ,7\n", intrinsic)
    curves = [each for node in made.nodes for each in curves_of(node)]
    assert len({each.time_axis for each in curves}) == 2
    assert sorted(each.values.tolist() for each in curves) == [[1, 5, 5], [2, 6, 6], [3, 8], [4, 7, 7]]
    parsed = json_reader.read(many.json_curves(50), PartialConvention())
    assert len({each.time_axis for node in parsed.nodes for each in curves_of(node)}) == 1


@pytest.mark.parametrize("options", [[], ["--order", "auto", "--fps", "3"]])
def test_angles_of_many_nodes_are_found_at_once(
    options: list[str], call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the angles of each node alone, as an angle tolerance that adds no key asks for."""
    (tmp_path / "in.glb").write_bytes(many.side_moving(300))
    line = ["to-euler", str(tmp_path / "in.glb"), str(tmp_path / "a.json"), "--clip", "#0", *options]
    counted = [count_calls(monkeypatch, euler, name) for name in ("unwrap", "from_quaternion")]
    call(*line).product()
    assert all(0 < len(each) < 10 for each in counted)
    together = (tmp_path / "a.json").read_text()
    call(*line, "--angle-tolerance", "90deg").product()
    assert len(counted[0]) > 300
    assert (tmp_path / "a.json").read_text() == together


def test_curves_of_a_bvh_share_their_modes(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "in.glb").write_bytes(many.side_moving(300))
    counted = [count_calls(monkeypatch, module, "uniform_modes") for module in (curve, to_bvh_motion)]
    call("to-euler", tmp_path / "in.glb", tmp_path / "a.bvh", "--clip", "#0").product()
    assert sum(map(len, counted)) == 1


def test_a_column_twice_among_many(call: Call, tmp_path: Path) -> None:
    header = ",".join(["time", *(f"n{i}.rx" for i in range(40_000)), "n39999.rx"])  # minutes if it were quadratic
    (tmp_path / "a.csv").write_text(f"{header}\n")
    line = ("--order", "XYZ", "--axes", "extrinsic", "--unit", "deg")
    said = refusal(call("from-euler", tmp_path / "a.csv", tmp_path / "out.glb", *line), 3)
    assert "column 'n39999.rx' twice" in said


def test_a_bvh_of_a_long_chain_is_as_long_as_the_chain(call: Call, tmp_path: Path) -> None:
    """Not as its square, by tabs; and it is read again."""
    sizes = []
    for count in (300, 600):
        (tmp_path / "in.glb").write_bytes(many.chain_open(count))
        call("to-euler", tmp_path / "in.glb", tmp_path / "out.bvh").product()
        sizes.append(len((tmp_path / "out.bvh").read_bytes()))
    assert sizes[1] < 2.1 * sizes[0]
    call("from-euler", tmp_path / "out.bvh", tmp_path / "again.glb").product()
    assert len(opened_path(tmp_path / "again.glb").json["nodes"]) == 601  # with its end site


def test_a_bvh_computes_angles_of_many_nodes_at_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = count_calls(monkeypatch, euler, "unwrap")
    (tmp_path / "in.glb").write_bytes(many.side_moving(500))
    call("to-euler", tmp_path / "in.glb", tmp_path / "out.bvh", "--clip", "#0").product()
    assert 0 < len(counted) < 5
