"""Files whose skin weights don't add up to 1: commands leave them as they are, and measure what three.js plays."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.reading import reader
from tests.anim.skinning.odd_rigs import with_bad_sums
from tests.cli.conftest import Call
from tests.files import opened
from tests.judge import judge, needs_judge


def test_the_document_keeps_its_weights(call: Call, asset: Callable[[str], Path], tmp_path: Path) -> None:
    bad = _spoiled(asset("CesiumMan.glb"), tmp_path)
    run = call("resample", bad, tmp_path / "out.glb", "--fps", "10")
    assert run.code == 0, run.err
    first, second = (
        reader.scene(opened(path.read_bytes())).instances[0].mesh.weight_sums for path in (bad, tmp_path / "out.glb")
    )
    assert first is not None
    assert second is not None
    assert np.array_equal(first, second)


@needs_judge
def test_errors_are_those_of_three(call: Call, asset: Callable[[str], Path], tmp_path: Path) -> None:
    """Of fewer keys, where weights that count twice would make twice the error."""
    bad, out = _spoiled(asset("CesiumMan.glb"), tmp_path), tmp_path / "out.glb"
    assert call("resample", bad, out, "--fps", "5").code == 0
    ours = json.loads(call("diff", bad, out, "--player", "three", "--format", "json").product())
    assert ours["max_error_m"] == pytest.approx(judge(bad, out).max_error, rel=0.01)


def _spoiled(path: Path, folder: Path) -> Path:
    bad = folder / "bad.glb"
    bad.write_bytes(with_bad_sums(path.read_bytes()))
    return bad
