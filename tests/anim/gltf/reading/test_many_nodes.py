"""Keys on many nodes: read and checked once."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import animations, reader
from anim.model import Clip, Track
from tests import many
from tests.calls import count_calls
from tests.files import opened


def test_keys_on_many_nodes_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened(many.side_moving(50))
    counted = count_calls(monkeypatch, animations.Reader, "_track")
    (clip,) = reader.clips(document)
    assert len(counted) == 1
    assert [track.node for track in clip.tracks] == list(range(50))
    first, *others = clip.tracks
    for track in others:
        assert track.values is first.values
        assert track.time_axis is first.time_axis
        assert track != first
    assert len({track.digest for track in clip.tracks}) == 50


def test_a_track_on_another_node_equals_one_made_there() -> None:
    keys = np.array([[0, 0, 0, 1], [0, 0, 1, 0]])
    track = Track(3, "rotation", "LINEAR", [0, 1], keys)
    assert track.digest
    moved = track.on_node(5)
    assert moved == Track(5, "rotation", "LINEAR", moved.time_axis, keys)
    assert moved.digest == Track(5, "rotation", "LINEAR", [0, 1], keys).digest
    assert Clip("", (track, moved)).time_axes == (track.time_axis,)
