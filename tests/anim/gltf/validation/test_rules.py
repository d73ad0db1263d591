"""Rules for many values at once: the same verdict as for one value after the other."""

from __future__ import annotations

from typing import Any

import pytest

from anim.errors import FormatError
from anim.gltf.validation.rules import MIN_COLUMN, ObjectRule, at_least, boolean, check_items, index, one_of, text

RULE = ObjectRule(
    {
        "view": index("bufferViews", 3),
        "offset": at_least(0),
        "type": one_of(5123, 5126),
        "name": text,
        "normalized": boolean,
        "target": ObjectRule({"node": index("nodes", 2)}, ("node",)),
    },
    ("view",),
)
VALID: dict[str, Any] = {
    "view": 2,
    "offset": 0,
    "type": 5126,
    "name": "",
    "normalized": True,
    "target": {"node": 1},
    "extras": [],
}
FAULTS: dict[str, Any] = {
    "view": 3,
    "offset": -1,
    "type": 5125,
    "name": None,
    "normalized": 1,
    "target": {"node": True},
}


def test_valid_values_pass_whatever_properties_they_have() -> None:
    values = [{"view": 0}, VALID, {"view": 1, "name": "a"}] * MIN_COLUMN
    assert RULE.passes(values)
    check_items(values, RULE, "accessors")


@pytest.mark.parametrize("key", FAULTS)
def test_a_fault_among_many_values_is_named_as_among_few(key: str) -> None:
    wrong = {**VALID, key: FAULTS[key]}
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
