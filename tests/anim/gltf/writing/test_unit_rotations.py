"""Non-unit rotations: found in all tracks of a clip at once, as in one after the other."""

from __future__ import annotations

import numpy as np

from anim.gltf.writing import unit_rotations
from tests.clips import clip, track

RNG = np.random.default_rng(7)


def _rotations(keys: int, *off: int) -> np.ndarray:
    values = RNG.normal(size=(keys, 4))
    values /= np.linalg.norm(values, axis=1, keepdims=True)
    values[list(off)] *= 1.1
    return values


def test_tracks_with_any_key_off_unit_length_are_found() -> None:
    given = [_rotations(5, 4), _rotations(1), _rotations(3, 0, 1), _rotations(40), _rotations(2, 1)]
    tracks = [track("rotation", np.arange(len(each)), each, node=i) for i, each in enumerate(given)]
    tracks.insert(2, track("translation", [0, 1], [[3, 0, 0], [0, 0, 0]]))
    found = unit_rotations._non_unit_tracks(clip(*tracks), range(len(tracks)))
    lengths = [np.linalg.norm(each.values, axis=1) for each in tracks]
    expected = [i for i, each in enumerate(tracks) if each.path == "rotation" and (np.abs(lengths[i] - 1) > 0.01).any()]
    assert found == expected == [0, 3, 5]
    assert unit_rotations._non_unit_tracks(clip(*tracks), [1, 2, 4]) == []
