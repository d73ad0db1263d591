"""Rotations are written as unit quaternions, those of the file as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.errors import RangeError
from anim.gltf.document import Buffer
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip
from fixtures.broken.pieces import animated, text
from tests.anim.gltf.writing.documents import rewritten
from tests.clips import CUBICSPLINE, track
from tests.files import opened


def test_new_rotations_are_normalized_with_their_tangents() -> None:
    document = opened(text(animated()))
    sides = (np.full((2, 4), 4.0), np.full((2, 4), 2.0))
    new = track("rotation", [0, 1], [[0, 0, 0, 2], [0, 0, 0, 1]], CUBICSPLINE, tangents=sides)
    (made,) = reader.clips(writer.replace_clips(document, {0: Clip("turn", (new,))}))[0].tracks
    assert made.values.tolist() == [[0, 0, 0, 1]] * 2
    assert made.in_tangents is not None
    assert made.in_tangents[:, 0].tolist() == [2, 4]


def test_rotations_that_were_off_in_the_file_stay() -> None:
    """Nobody asked for another motion in players that take them as they are."""
    off = track("rotation", [0, 1], [[0, 0, 0, 2]] * 2)
    unit = track("rotation", [0, 1], [[0, 0, 1, 0]] * 2)
    written = writer.replace_clips(opened(text(animated())), {0: Clip("", (unit,))})
    data = np.array(written.buffers[0].data)
    data[-32:] = np.array([[0, 0, 0, 2]] * 2, "<f4").view(np.uint8).ravel()
    spoiled = replace(written, buffers=(Buffer(len(data), None, lambda: data),))
    assert reader.clips(spoiled)[0].tracks[0].values.tolist() == off.values.tolist()
    assert reader.clips(rewritten(spoiled))[0].tracks[0].values.tolist() == off.values.tolist()


def test_a_rotation_of_no_length_is_refused() -> None:
    new = track("rotation", [0, 1], [[0, 0, 0, 1], [0, 0, 0, 0]])
    with pytest.raises(RangeError, match="clip 'turn', rotation of node 0: key 1 is zero"):
        writer.replace_clips(opened(text(animated())), {0: Clip("turn", (new,))})
