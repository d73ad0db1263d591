"""Samples of STEP tracks lie on both sides of their jumps, also where rounding puts frames beside keys."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.exchange.usd_skel.sample_times import add_times, sample_times
from anim.gltf.reading import reader
from anim.model import Clip, Track
from tests.anim.exchange.usd_skel.test_write import compare
from tests.files import opened_fixture

FPS = 24.0
KEYS = (np.arange(13) / FPS).astype(np.float32)


def stepping(node: int, count: int = len(KEYS)) -> Track:
    values = np.zeros((count, 3))
    values[1::2, 1] = 0.5
    return Track(node, "translation", "STEP", KEYS[:count], values)


def test_frames_beside_jumps() -> None:
    found = sample_times(Clip("step", (stepping(0),)), FPS)
    assert len(found) == 1 + 2 * 12
    assert found[2::2] == pytest.approx(KEYS[1:].astype(float), abs=0)
    assert np.diff(found)[1::2] == pytest.approx(1e-6, rel=1e-2)


def test_jumps_of_several_tracks_that_rounding_separates() -> None:
    later = Track(1, "translation", "STEP", np.nextafter(KEYS, np.float32(9)).astype(float), stepping(0).values)
    found = sample_times(Clip("step", (stepping(0), later)), FPS, with_keys=True)
    assert np.diff(found).min() > 5e-7
    assert set(later.times[1:].tolist()) <= set(found.tolist())


def test_times_are_added_unless_they_are_there() -> None:
    assert add_times(np.array([0.0, 1.0]), np.array([-1, 1e-9, 0.5, 1 - 1e-9, 2])).tolist() == [-1, 0, 0.5, 1, 2]
    assert add_times(np.empty(0), np.array([1.0, 2.0])).tolist() == [1, 2]


def test_usd_cores_vertices_jump_at_frames(tmp_path: Path) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    document = opened_fixture("arm")
    joint = reader.skeleton(document).names.index("lower")
    result = compare(document, Clip("step", (stepping(joint),)), tmp_path, fps=FPS)
    assert result.error.distance < 1e-5
