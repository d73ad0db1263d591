"""Rules for many values at once: the same verdict as for one value after the other."""

from __future__ import annotations

import math
from typing import Any

import pytest

from anim.errors import FormatError
from anim.gltf.validation.rules import (
    MIN_COLUMN,
    ObjectRule,
    at_least,
    boolean,
    check_items,
    index,
    list_of,
    map_of,
    numbers,
    one_of,
    text,
)


def _refuse_both(value: dict[str, Any]) -> None:
    if "view" in value and "weights" in value and not value["weights"]:
        raise FormatError("has a view and no weights")


RULE = ObjectRule(
    {
        "view": index("bufferViews", 3),
        "offset": at_least(0),
        "type": one_of(5123, 5126),
        "name": text,
        "normalized": boolean,
        "target": ObjectRule({"node": index("nodes", 2)}, ("node",)),
        "children": list_of(index("nodes", 2)),
        "channels": list_of(ObjectRule({"sampler": at_least(0)}, ("sampler",))),
        "attributes": map_of(index("accessors", 2)),
        "translation": numbers(3),
        "weights": numbers(None),
    },
    ("view",),
    _refuse_both,
)
VALID: dict[str, Any] = {
    "view": 2,
    "offset": 0,
    "type": 5126,
    "name": "",
    "normalized": True,
    "target": {"node": 1},
    "children": [0, 1],
    "channels": [{"sampler": 0}],
    "attributes": {"POSITION": 0, "NORMAL": 1},
    "translation": [0, 1.5, -2],
    "weights": [1],
    "extras": [],
}
FAULTS: tuple[tuple[str, Any], ...] = (
    ("view", 3),
    ("offset", -1),
    ("type", 5125),
    ("name", None),
    ("normalized", 1),
    ("target", {"node": True}),
    ("children", {}),
    ("children", [0, 2]),
    ("children", [0, [1]]),
    ("channels", [{"sampler": 0}, {}]),
    ("attributes", []),
    ("attributes", {"POSITION": 2}),
    ("translation", (0, 0, 0)),
    ("translation", [0, 0]),
    ("translation", [0, 0, True]),
    ("translation", [0, 0, 1e39]),
    ("translation", [0, math.nan, 0]),
    ("translation", [0, 0, 10**400]),
    ("weights", []),
)


def test_valid_values_pass_whatever_properties_they_have() -> None:
    values = [{"view": 0}, VALID, {"view": 1, "name": "a", "children": []}, {"view": 1, "attributes": {}}] * MIN_COLUMN
    assert RULE.passes(values)
    check_items(values, RULE, "accessors")


@pytest.mark.parametrize(("key", "fault"), FAULTS)
def test_a_fault_among_many_values_is_named_as_among_few(key: str, fault: object) -> None:
    wrong = {**VALID, key: fault}
    assert not RULE.passes([wrong])
    assert _fault([VALID, wrong]) == _fault([VALID, wrong] + [VALID] * MIN_COLUMN)


@pytest.mark.parametrize("wrong", [{}, {"offset": 0}, None, [], 1.0])
def test_what_is_no_such_object_is_named_among_many(wrong: object) -> None:
    assert not RULE.passes([VALID, wrong])
    assert _fault([VALID, wrong]) == _fault([VALID, wrong] + [VALID] * MIN_COLUMN)


def _fault(values: list[Any]) -> str:
    with pytest.raises(FormatError) as refusal:
        check_items(values, RULE, "accessors")
    return str(refusal.value)
