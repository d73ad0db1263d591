"""Track: its invariants, its target and its kind."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from anim.errors import RangeError, ShapeError
from anim.model import FLOAT32, AccessorFormat, Clip, Interpolation, Track, ValueKind
from tests.clips import CUBICSPLINE, LINEAR, STEP, track

BYTES = AccessorFormat(5121, False, "SCALAR")
FRACTIONS = AccessorFormat(5121, True, "SCALAR")


def test_keys_are_read_only_float64() -> None:
    made = track("scale", [0, 1], [[1, 1, 1], [2, 2, 2]], CUBICSPLINE, tangents=(np.zeros((2, 3)), np.ones((2, 3))))
    for array in (made.times, made.values, made.in_tangents, made.out_tangents):
        assert array is not None
        assert array.dtype == np.float64
        assert not array.flags.writeable
    with pytest.raises(FrozenInstanceError):
        made.node = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (("scale", [0, 1], [[1, 1, 1]]), ShapeError, r"\(1, 3\) \(expected \(2, 3\)\)"),
        (("scale", [0], [[1, 1]]), ShapeError, r"\(1, 2\) \(expected \(1, 3\)\)"),
        (("translation", [0], [[1, 1, 1, 1]]), ShapeError, r"\(1, 4\)"),
        (("rotation", [0], [[1, 1, 1]]), ShapeError, r"\(1, 3\) \(expected \(1, 4\)\)"),
        (("weights", [0], [1]), ShapeError, r"shape \(1,\)"),
        (("weights", [0], [["heavy"]]), ShapeError, "no number"),
        (("weights", [], np.zeros((0, 1))), RangeError, "empty"),
        (("weights", [-1], [[1]]), RangeError, "start at -1"),
        (("weights", [0, 0], [[1], [1]]), RangeError, "not increasing"),
        (("weights", [0], [[float("nan")]]), RangeError, "nan"),
        (("weights", [0], [[1]], CUBICSPLINE), ShapeError, "tangents"),
    ],
)
def test_keys_that_can_not_be_are_refused(arguments: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        track(*arguments)


@pytest.mark.parametrize("mode", [STEP, LINEAR])
def test_only_splines_have_tangents(mode: Any) -> None:
    with pytest.raises(ShapeError, match="tangents"):
        track("weights", [0], [[1]], mode, tangents=([[0]], [[0]]))


@pytest.mark.parametrize("sides", [(np.zeros((2, 1)), None), (None, np.zeros((2, 1)))])
def test_tangents_come_in_pairs(sides: Any) -> None:
    with pytest.raises(ShapeError, match="tangents"):
        Track(0, "weights", CUBICSPLINE, np.arange(2.0), np.zeros((2, 1)), *sides)


@pytest.mark.parametrize("bad", [np.zeros((1, 1)), np.zeros((2, 2)), np.zeros(2), [[0], [float("inf")]]])
def test_tangents_have_the_values_shape(bad: Any) -> None:
    for sides in ((bad, np.zeros((2, 1))), (np.zeros((2, 1)), bad)):
        with pytest.raises((ShapeError, RangeError), match="tangents"):
            track("weights", [0, 1], [[1], [2]], CUBICSPLINE, tangents=sides)


@pytest.mark.parametrize(
    ("path", "width", "mode", "storage", "kind"),
    [
        ("translation", 3, LINEAR, FLOAT32, ValueKind.VECTOR),
        ("rotation", 4, STEP, FLOAT32, ValueKind.ROTATION),
        ("weights", 4, LINEAR, FRACTIONS, ValueKind.VECTOR),
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", 4, LINEAR, FLOAT32, ValueKind.VECTOR),
        ("/extensions/EXT_lights_image_based/lights/0/rotation", 4, LINEAR, FLOAT32, ValueKind.ROTATION),
        ("/materials/0/extensions/KHR_texture_transform/rotation", 1, LINEAR, FLOAT32, ValueKind.VECTOR),
        ("/nodes/0/extensions/KHR_node_visibility/visible", 1, STEP, BYTES, ValueKind.DISCRETE),
        ("/materials/0/alphaCutoff", 1, STEP, FLOAT32, ValueKind.VECTOR),
        ("/materials/0/alphaCutoff", 1, STEP, FRACTIONS, ValueKind.VECTOR),
        ("/materials/0/alphaCutoff", 1, LINEAR, BYTES, ValueKind.VECTOR),
    ],
)
def test_kinds(path: str, width: int, mode: Any, storage: AccessorFormat, kind: ValueKind) -> None:
    values = np.tile([0.0, 0, 0, 1][-width:], (1, 1))
    assert track(path, [0], values, mode, storage=storage).kind is kind


def test_targets() -> None:
    assert track("scale", [0], [[1, 1, 1]], node=3).target == (3, "scale")
    assert track("/materials/0/alphaCutoff", [0], [[1]]).target == (None, "/materials/0/alphaCutoff")


@pytest.mark.parametrize("word", Interpolation)
def test_an_interpolation_may_be_its_word(word: str) -> None:
    sides = (np.zeros((2, 3)),) * 2 if word == "CUBICSPLINE" else ()
    made = Track(0, "translation", str(word), [0, 1], [[0, 0, 0], [2, 4, 6]], *sides)
    assert made.interpolation is Interpolation(word)


@pytest.mark.parametrize("word", ["linear", "foo", None])
def test_other_interpolations_are_refused(word: Any) -> None:
    with pytest.raises(RangeError, match=r"interpolation is .* \(expected STEP, LINEAR, CUBICSPLINE\)"):
        track("weights", [0], [[1]], word)


@pytest.mark.parametrize(
    ("node", "path", "error", "message"),
    [
        (-1, "scale", RangeError, "node is -1"),
        ("hips", "scale", ShapeError, "node is 'hips'"),
        (0.0, "scale", ShapeError, "node is 0.0"),
        (None, "scale", RangeError, "node is None with path 'scale'"),
        (0, "pointer", RangeError, "node is 0 with path 'pointer'"),
        (0, "position", RangeError, "path is 'position' .expected translation, rotation, scale, weights or pointer"),
    ],
)
def test_targets_that_can_not_be_are_refused(node: Any, path: str, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        track(path, [0], [[1, 1, 1]], node=node)


def test_a_node_is_a_plain_integer() -> None:
    assert type(track("scale", [0], [[1, 1, 1]], node=np.int64(3)).node) is int  # type: ignore[arg-type]


def test_tracks_and_clips_are_equal_by_their_numbers() -> None:
    one, same = (track("scale", [0, 1], [[1, 1, 1], [2, 2, 2]]) for _ in range(2))
    other = track("scale", [0, 1], [[1, 1, 1], [2, 2, 3]])
    assert one == same
    assert one != other
    assert one != 3
    assert len({one, same, other}) == 2
    assert Clip("a", (one,)) == Clip("a", (same,))
    assert len({Clip("a", (one,)), Clip("a", (same,)), Clip("a", (other,))}) == 2


def test_same_keys_may_be_stored_in_other_formats() -> None:
    one = track("weights", [0, 1], [[0], [1]])
    assert one.has_same_keys(replace(one, storage=FRACTIONS))
    assert one != replace(one, storage=FRACTIONS)
    others = (replace(one, node=5), replace(one, interpolation=STEP), track("weights", [0, 2], [[0], [1]]))
    assert not any(one.has_same_keys(each) for each in others)
