"""Euler files of many nodes: work on all of them at once, counted by calls."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.curves.fitting import stacked_keys
from anim.exchange.euler import from_euler
from anim.maths import euler
from tests import many
from tests.cli.conftest import Call


def count_calls(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> list[None]:
    """Count the calls of a function from now on, in a list that grows with each."""
    counted: list[None] = []
    function = getattr(owner, name)

    def called(*args: object, **options: object) -> object:
        counted.append(None)
        return function(*args, **options)

    monkeypatch.setattr(owner, name, called)
    return counted


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
