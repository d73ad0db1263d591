"""JSON curves: the documented schema, and its faults."""

from __future__ import annotations

import dataclasses
import json as plain_json
from typing import Any

import numpy as np
import pytest

from anim.errors import FormatError, RangeError, UnsupportedError
from anim.exchange.euler.convention import UNSPECIFIED, PartialConvention
from anim.exchange.euler.curve import Mode
from anim.exchange.euler.evaluate import evaluate_translation
from anim.exchange.euler.motion import OFFSETS, Convention, EulerMotion, Pivots, Unit
from anim.exchange.formats import bvh_writer, csv_writer, json_reader
from anim.maths import euler
from anim.maths.euler import AxesConvention

CURVES: dict[str, Any] = {
    "schema": "euler-curves/1",
    "order": "XYZ",
    "frame": "extrinsic",
    "unit": "deg",
    "meters_per_unit": 0.01,
    "nodes": [
        {
            "name": "arm",
            "parent": "body",
            "translation": [0, 12, 0],
            "rotation": [0, 0, 90],
            "pre_rotation": [0, 0, 45],
            "post_rotation": [0, 0, 0, 2],
            "rotation_pivot": [1, 0, 0],
            "curves": {
                "rotation.x": {"times": [0, 1], "values": [0, 720]},
                "rotation.y": {
                    "times": [0, 0.5, 2],
                    "values": [0, 30, 0],
                    "interpolation": "cubic",
                    "in_tangents": [0, 0, 0],
                    "out_tangents": [60, 0, 0],
                    "out_weights": [0.5, 0.25, 0.3],
                },
                "translation.z": {"times": [0, 1], "values": [0, 5], "interpolation": ["step", "linear"]},
            },
        },
        {"name": "body", "order": "ZXZ", "curves": {"rotation.1": {"times": [0], "values": [9]}}},
    ],
}


def _read(content: dict[str, Any], options: PartialConvention = UNSPECIFIED) -> Any:
    return json_reader.read(plain_json.dumps(content).encode(), options)


def _changed(path: str, value: object) -> dict[str, Any]:
    content: Any = plain_json.loads(plain_json.dumps(CURVES))
    at = content
    *way, last = path.split("/")
    for step in way:
        at = at[int(step)] if isinstance(at, list) else at[step]
    at[int(last) if isinstance(at, list) else last] = value
    return dict(content)


def test_the_documented_schema_is_read() -> None:
    body, arm = _read(CURVES).nodes
    assert (body.name, body.order, arm.name, arm.parent) == ("body", "ZXZ", "arm", 0)
    np.testing.assert_allclose(arm.translation, (0, 0.12, 0))
    np.testing.assert_allclose(arm.angles, np.radians((0, 0, 90)))
    turned = euler.to_quaternion(np.radians((0, 0, 45.0)), order="XYZ", frame=AxesConvention.EXTRINSIC)
    np.testing.assert_allclose(arm.pivots.pre_rotation, turned)
    np.testing.assert_allclose(arm.pivots.post_rotation, (0, 0, 0, 1))
    np.testing.assert_allclose(arm.pivots.rotation_pivot, (0.01, 0, 0))
    np.testing.assert_allclose(arm.rotation[1].out_tangents, np.radians((60, 0, 0)))
    np.testing.assert_allclose(arm.rotation[1].out_weights, (0.5, 0.25, 0.3))
    assert arm.rotation[1].in_weights is None
    assert arm.moves[2].modes.tolist() == [Mode.STEP, Mode.LINEAR]
    np.testing.assert_allclose(arm.moves[2].values, (0, 0.05))


@pytest.mark.parametrize("name", OFFSETS)
def test_the_unit_of_length_applies_to_offsets_and_pivots(name: str) -> None:
    arm = _read(_changed(f"nodes/0/{name}", [50, 0, -20])).nodes[1]
    np.testing.assert_allclose(getattr(arm.pivots, name), (0.5, 0, -0.2))


def test_a_pivot_in_centimetres_moves_its_node_by_metres() -> None:
    z = {"times": [0, 1], "values": [0, 90]}
    arm = {"name": "arm", "translation": [0, 100, 0], "rotation_pivot": [50, 0, 0], "curves": {"rotation.z": z}}
    motion = _read({**CURVES, "nodes": [arm]})
    np.testing.assert_allclose(evaluate_translation(motion.nodes[0], np.array([1.0])), [(0.5, 0.5, 0)], atol=1e-12)


def test_other_formats_refuse_pivots() -> None:
    motion = _read(CURVES)
    convention = Convention("XYZ", AxesConvention.EXTRINSIC, Unit.DEG)
    for nodes in (motion.nodes[1:], motion.nodes[:1]):
        with pytest.raises(UnsupportedError, match="a BVH has intrinsic angles and no pivots"):
            bvh_writer.write(EulerMotion(nodes))
    with pytest.raises(UnsupportedError, match="a CSV has no pivots"):
        csv_writer.write(EulerMotion(motion.nodes[1:]), convention)


def test_what_is_written_is_read_as_the_same() -> None:
    content = _changed("nodes/1", {"name": "body"})
    motion = _read(content)
    again = json_reader.read(
        json_reader.write(motion, Convention("XYZ", AxesConvention.EXTRINSIC, Unit.RAD)), UNSPECIFIED
    )
    one, two = motion.nodes[1], again.nodes[1]
    np.testing.assert_allclose(two.angles, one.angles)
    for field in dataclasses.fields(Pivots):
        np.testing.assert_allclose(getattr(two.pivots, field.name), getattr(one.pivots, field.name), atol=1e-9)
    for a, b in zip([*one.rotation[:2], one.moves[2]], [*two.rotation[:2], two.moves[2]], strict=True):
        assert a is not None
        assert b is not None
        np.testing.assert_allclose(b.values, a.values, atol=1e-9)
        np.testing.assert_array_equal(b.modes, a.modes)
        assert (b.out_weights is None) == (a.out_weights is None)


def test_keys_before_zero_come_later_all_by_as_much() -> None:
    motion = _read(_changed("nodes/0/curves/rotation.x/times", [-0.5, 1]))
    arm, body = motion.nodes[1], motion.nodes[0]
    np.testing.assert_allclose(arm.rotation[0].times, (0, 1.5))
    np.testing.assert_allclose(arm.rotation[1].times, (0.5, 1, 2.5))
    np.testing.assert_allclose(body.rotation[0].times, (0.5,))
    assert motion.notes == ("the first key is at -0.5 s: all are moved by 0.5 s, to begin at 0",)
    assert _read(CURVES).notes == ()


def test_keys_that_the_shift_brings_together_are_named() -> None:
    content = _changed("nodes/0/curves/rotation.x/times", [0, 1e-30])
    content["nodes"][0]["curves"]["rotation.y"]["times"] = [-1e8, 0, 1]
    with pytest.raises(FormatError, match="keys 0 and 1 are 1e-30 s apart, which float64 doesn't hold 1e\\+08 s later"):
        _read(content)


@pytest.mark.parametrize(
    ("path", "value", "problem"),
    [
        ("schema", "fbx", "schema is 'fbx'"),
        ("order", "XYY", "order is 'XYY'"),
        ("nodes", [], "has no nodes"),
        ("meters_per_unit", 0, "meters_per_unit is 0"),
        ("nodes/0/name", "", r"nodes\[0\]: has no name"),
        ("nodes/1/name", "arm", r"nodes\[1\]: a second node 'arm'"),
        ("nodes/0/parent", "leg", "parent 'leg', which is not there"),
        ("nodes/0/translation", [1, 2], r"nodes\[0\]: translation is not a list of 3 numbers"),
        ("nodes/0/post_rotation", [0, 0, 0, 0], "post_rotation is zero"),
        ("nodes/0/curves/rotation.w", {"times": [0], "values": [0]}, r"curves\['rotation.w'\]: unknown channel"),
        ("nodes/1/curves/rotation.z", {"times": [0], "values": [0]}, "no single place in order ZXZ"),
        ("nodes/0/curves/rotation.x/values", [1], "values is not a list of 2 numbers"),
        ("nodes/0/curves/rotation.x/times", [1, 0], "times not increasing at key 1"),
        ("nodes/0/curves/rotation.x/times", [-1, -2], "times not increasing at key 1 .-2 s after -1 s"),
        ("nodes/0/curves/rotation.y/out_weights", [0, 0.5], "out_weights is not a list of 3 numbers"),
        ("nodes/0/curves/rotation.y/out_weights", [0, 0.5, 1.5], r"out_weights go from 0 to 1.5 .expected shares"),
        ("nodes/0/curves/rotation.x/interpolation", "smooth", "interpolation is 'smooth'"),
        ("nodes/0/curves/rotation.x/interpolation", "cubic", "a cubic curve lacks in_tangents"),
        ("nodes/0/curves/rotation.x/tension", 1, r"curves\['rotation.x'\]: unknown key 'tension'"),
        ("nodes/0/curves/rotation.x", {"times": [0]}, "expected an object with times and values"),
        ("nodes/0/pre_rotaton", [0, 0, 9], r"nodes\[0\]: unknown key 'pre_rotaton'"),
        ("meters_per_units", 1, "unknown key 'meters_per_units'"),
        ("meters_per_unit", True, "meters_per_unit is True"),
    ],
)
def test_a_fault_is_told_with_its_place(path: str, value: object, problem: str) -> None:
    with pytest.raises(FormatError, match=problem):
        _read(_changed(path, value))


@pytest.mark.parametrize(
    ("number", "problem"), [("1e300", r"values holds a number beyond 1e\+15"), ("1e999", "too large for float64")]
)
def test_a_number_beyond_any_use_is_refused(number: str, problem: str) -> None:
    content = plain_json.dumps(_changed("nodes/0/curves/rotation.x/values", [0, 7.25])).replace("7.25", number)
    with pytest.raises(FormatError, match=problem):
        json_reader.read(content.encode(), UNSPECIFIED)


def test_the_convention_is_never_guessed() -> None:
    content = _changed("order", "XYZ")
    del content["frame"]
    with pytest.raises(RangeError, match="axes convention not specified"):
        _read(content)
    assert _read(content, PartialConvention(frame=AxesConvention.INTRINSIC)).nodes[1].frame == AxesConvention.INTRINSIC
    with pytest.raises(RangeError, match=r"rotation order is XYZ in the file \(got YXZ\)"):
        _read(content, PartialConvention("YXZ", AxesConvention.INTRINSIC))


def test_broken_json_has_line_and_column() -> None:
    with pytest.raises(FormatError, match="line 2, column"):
        json_reader.read(b'{"schema":\n oops}', UNSPECIFIED)
