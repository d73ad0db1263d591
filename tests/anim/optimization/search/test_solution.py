"""The size of a solution, against what a file of it takes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.model import FLOAT32, Clip, Interpolation
from anim.optimization.options import Objective, Packing
from anim.optimization.search.plan import Solution, value_bytes
from anim.optimization.tracks.key_reduction import INT16
from anim.optimization.tracks.quantization import BYTE_COSTS, EncodedKeys, Encoding, encode_all
from tests.clips import about, clip, track

PRICE = BYTE_COSTS[Objective.FILE]
CORE, EXT = (Encoding(packing, PRICE) for packing in (Packing.CORE, Packing.EXT))
LINES = track("translation", [0, 1, 2], np.eye(3), node=0)
TURNS = track("rotation", [0, 1, 2], about("z", [0, 10, 20]), node=0)


def _solution(what: Clip) -> Solution:
    return Solution(what, tuple(EncodedKeys(each.values, "as it is") for each in what.tracks), ())


def test_values_as_stored() -> None:
    assert value_bytes(LINES) == 36
    assert value_bytes(replace(TURNS, storage=INT16)) == 24
    assert value_bytes(replace(TURNS, storage=FLOAT32)) == 48
    zeros = np.zeros((3, 3))
    spline = replace(LINES, interpolation=Interpolation.CUBICSPLINE, in_tangents=zeros, out_tangents=zeros)
    assert value_bytes(spline) == 108


def test_axes_and_equal_values_count_once() -> None:
    times = np.array([0.0, 1, 2])
    one, other = (track(*each, node=0) for each in (("translation", times, np.eye(3)), ("scale", times, 2 * np.eye(3))))
    apart, shared = _solution(clip(one, other)), _solution(clip(one, replace(other, time_axis=one.time_axis)))
    assert shared.size(CORE) == 2 * PRICE.track + 2 * 36 + PRICE.axis + 12
    assert apart.size(CORE) - shared.size(CORE) == PRICE.axis + 12
    again = replace(one, node=1, interpolation=Interpolation.STEP)
    assert _solution(clip(one, again)).size(CORE) == 2 * PRICE.track + 36 + PRICE.axis + 12


def test_single_keys_are_cheaper() -> None:
    held = clip(track("translation", [0], [[1, 2, 3]], node=0))
    assert _solution(held).size(CORE) == PRICE.single_key + 12 + PRICE.axis + 4


def test_filtered_tracks_count_as_the_codec_has_them() -> None:
    (keys,) = encode_all([TURNS.values], [("quaternion", 10)])
    both = clip(TURNS, replace(LINES, time_axis=TURNS.time_axis))
    found = Solution(both, (keys, EncodedKeys(LINES.values, "as it is")), ()).size(EXT)
    assert found == 2 * PRICE.track + PRICE.axis + 12 + 36 + EXT.size([keys])
