"""Keys of many tracks stored at once, against each track by itself."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.optimization.options import Packing
from anim.optimization.tracks.quantization import (
    MAX_FLOAT32_KEYS,
    MIN_FILTER_ERROR,
    MIN_INT16_ERROR,
    choose_format,
    encode,
    encode_stack,
)

COUNTS = [9, 30, 1, MAX_FLOAT32_KEYS, MAX_FLOAT32_KEYS + 1, 17, 30, 12]
TOLERANCES = [1e-3, 1e-6, 1e-2, 1e-2, 1e-2, MIN_INT16_ERROR, MIN_FILTER_ERROR, 0.0]


def _stack(path: str) -> tuple[Floats, list[str]]:
    """Keys (C, T, 30), any after a track's last one, with the path of each track."""
    random = np.random.default_rng(6)
    if path == "rotation":
        keys = random.normal(size=(4, len(COUNTS), 30))
        return keys / np.linalg.norm(keys, axis=0), [path] * len(COUNTS)
    scales = np.geomspace(1e-3, 1e3, len(COUNTS))[:, None]
    return scales * random.normal(size=(3, len(COUNTS), 30)), ["translation", "scale"] * (len(COUNTS) // 2)


@pytest.mark.parametrize("packing", Packing)
@pytest.mark.parametrize("path", ["rotation", "translation"])
def test_tracks_together_are_stored_as_each_alone(path: str, packing: Packing) -> None:
    keys, paths = _stack(path)
    before = keys.copy()
    stored, decoded = encode_stack(keys, COUNTS, paths, TOLERANCES, packing)
    assert (keys == before).all()
    assert decoded.shape == keys.shape
    forms = set()
    for t, (count, each) in enumerate(zip(COUNTS, stored, strict=True)):
        own = keys[:, t, :count].T
        expected = encode(own, choose_format(own, paths[t], TOLERANCES[t], packing))
        assert (each.form, each.codes, each.error) == (expected.form, expected.codes, expected.error)
        np.testing.assert_array_equal(each.values, expected.values)
        np.testing.assert_array_equal(decoded[:, t, :count], expected.values.T)
        assert each.name == expected.name
        forms.add(each.form)
    assert len(forms) == (2 if path == "rotation" else 1)


@pytest.mark.parametrize("packing", Packing)
def test_no_tracks(packing: Packing) -> None:
    stored, decoded = encode_stack(np.zeros((4, 0, 3)), [], [], [], packing)
    assert stored == []
    assert decoded.shape == (4, 0, 3)
