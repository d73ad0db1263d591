"""Skin weights that don't add up to 1: shares of their sum, for whatever reads them, and as three.js has it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.model import Mesh
from anim.skinning.analysis.weight_sums import unnormalized_weights
from anim.skinning.bake import bake
from fixtures.broken.pieces import buffered, text
from tests.anim.skinning.odd_rigs import with_bad_sums
from tests.files import opened
from tests.judge import needs_judge, vertices

UINT8, UINT16, FLOAT = 5121, 5123, 5126
STEPS = {UINT8: 255, UINT16: 65535}


def test_sets_are_normalized_together() -> None:
    body = _read([[1, 0, 0, 0]], [[0.5, 0.25, 0, 0]], second=[[0.5, 0, 0, 0]])
    assert body.weights.tolist() == [[0.4, 0.2, 0, 0, 0.4, 0, 0, 0]]
    assert body.weight_sums is not None
    assert body.weight_sums.tolist() == [1.25]


def test_a_vertex_without_weight_follows_the_first_joint_listed() -> None:
    body = _read([[1, 0, 0, 0], [1, 0, 0, 0], [200, 1, 1, 1]], [[1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]])
    assert body.weights.tolist() == [[1, 0, 0, 0]] * 3
    assert body.joints[:, 0].tolist() == [1, 1, 0], "and joint 0 where the skin has none of that number"
    assert body.weight_sums is not None
    assert body.weight_sums.tolist() == [1, 0, 0]


@pytest.mark.parametrize("kind", [UINT8, UINT16])
def test_rounding_is_taken_away_and_not_told(kind: int) -> None:
    """A quarter of three and one, cut off: 191 + 63 of 255. A sum of 0.9 is no rounding."""
    steps = STEPS[kind]
    cut = [int(0.75 * steps), int(0.25 * steps), 0, 0]
    body = _read([[0, 1, 0, 0]], [cut], kind=kind)
    assert sum(cut) == steps - 1
    assert body.weights.sum() == pytest.approx(1, abs=1e-15)
    assert body.weight_sums is None
    off = _read([[0, 1, 0, 0]], [[int(0.9 * steps), 0, 0, 0]], kind=kind).weight_sums
    assert off is not None
    assert off[0] == pytest.approx(0.9, abs=1 / steps)


@needs_judge
def test_vertices_are_where_three_has_them(asset: Callable[[str], Path], tmp_path: Path) -> None:
    bad = _spoiled(asset("CesiumMan.glb"), tmp_path)
    document = opened(bad.read_bytes())
    of, (walk,) = reader.scene(document), reader.clips(document)
    assert unnormalized_weights(of.instances)[0].count > 1000
    ours = bake(of, walk, times=np.array([0.7])).load_all().positions[0]
    theirs = vertices(bad, clip=0, time=0.7)
    assert np.abs(ours - theirs).max() < 1e-6 * np.linalg.norm(np.ptp(theirs, axis=0))


def _spoiled(path: Path, folder: Path) -> Path:
    bad = folder / "bad.glb"
    bad.write_bytes(with_bad_sums(path.read_bytes()))
    return bad


def _read(joints: Any, weights: Any, *, second: Any = None, kind: int = FLOAT) -> Mesh:
    """The mesh of these influences, on a skin of two joints."""
    count = len(joints)
    arrays = [("VEC3", FLOAT, np.eye(3)[:count]), ("VEC4", UINT8, joints), ("VEC4", kind, weights)]
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    if second is not None:
        arrays += [("VEC4", UINT8, joints), ("VEC4", FLOAT, second)]
        attributes |= {"JOINTS_1": 3, "WEIGHTS_1": 4}
    content = buffered(*arrays)
    content["accessors"][2]["normalized"] = kind != FLOAT
    content["nodes"] = [{"mesh": 0, "skin": 0}, {"children": [2]}, {}]
    content["meshes"] = [{"primitives": [{"attributes": attributes}]}]
    content["skins"] = [{"joints": [1, 2]}]
    return reader.scene(opened(text(content))).instances[0].mesh
