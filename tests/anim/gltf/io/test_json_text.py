"""JSON text: what was laid out stays laid out, and everything comes back."""

from __future__ import annotations

import copy
import json
import math
import pickle
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from anim.errors import FormatError
from anim.gltf.io import json_text

LEAVES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
VALUES = st.recursive(LEAVES, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8)


@given(st.dictionaries(st.text(), VALUES), st.sampled_from([None, 1, 2, 4]))
def test_everything_comes_back_in_its_order(content: dict[str, Any], indent: int | None) -> None:
    back = json_text.parse(json_text.dump(content, indent))
    assert json.dumps(back) == json.dumps(content)


def test_layout_by_hand() -> None:
    content = {"a": [1, 2.5], "b": {}, "c": [{"d": "é"}, []], "e": []}
    assert json_text.dump(content) == '{"a":[1,2.5],"b":{},"c":[{"d":"é"},[]],"e":[]}'.encode()
    assert json_text.dump(content, 2).decode() == (
        '{\n  "a": [1, 2.5],\n  "b": {},\n  "c": [\n    {\n      "d": "é"\n    },\n    []\n  ],\n  "e": []\n}'
    )


@pytest.mark.parametrize(
    ("raw", "indent"),
    [
        (b'{"a":1}', None),
        (b'{ "a": 1 }', None),
        (b'{\n  "a": 1}', 2),
        (b'{\r\n    "a": 1}', 4),
        (b'{\n\t"a": 1}', 1),
        (b'\n{\n "a": 1}', 1),
        (b'{\n"a": 1}', None),
        (b"{}", None),
    ],
)
def test_indent_of(raw: bytes, indent: int | None) -> None:
    assert json_text.indent_of(raw) == indent


def test_a_lone_surrogate_survives_as_an_escape() -> None:
    raw = b'{"name":"\\ud800"}'
    assert json_text.dump(json_text.parse(raw)) == raw
    assert json.loads(json_text.dump(json_text.parse(raw), 2)) == json.loads(raw)


BEYOND = '{"a":[1,1e999,-2.5E+400],"é":{"c":-1e309,"d":0.5},"e":[{"f":1E310}]}'


def test_numbers_beyond_any_float_stay_as_they_were() -> None:
    """Readers take them for infinite; what is in extras is not ours to judge."""
    content = json_text.parse(BEYOND.encode())
    assert content["a"] == [1, math.inf, -math.inf]
    assert json_text.dump(content) == BEYOND.encode()
    laid_out = json_text.dump(content, 2)
    assert b'  "a": [1, 1e999, -2.5E+400],\n' in laid_out
    assert b'    "c": -1e309,\n' in laid_out
    assert json_text.dump(json_text.parse(laid_out)) == BEYOND.encode()


def test_numbers_beyond_any_float_beside_a_lone_surrogate() -> None:
    raw = b'{"name":"\\ud800","extras":[1e999]}'
    assert json_text.dump(json_text.parse(raw)) == raw
    assert json_text.dump(json_text.parse(raw), 1) == b'{\n "name": "\\ud800",\n "extras": [1e999]\n}'


def test_numbers_beyond_any_float_survive_copies() -> None:
    content = json_text.parse(b'{"a":1e999}')
    for copied in (copy.deepcopy(content), pickle.loads(pickle.dumps(content))):
        assert json_text.dump(copied) == b'{"a":1e999}'


@pytest.mark.parametrize("raw", [b'{"a":NaN}', b'{"a":Infinity}', b'{"a":-Infinity}', b"[1]", b"1", b"null", b"", b"{"])
def test_what_is_no_json_object_is_refused(raw: bytes) -> None:
    with pytest.raises(FormatError, match="JSON"):
        json_text.parse(raw)


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_what_json_can_not_hold_is_refused(number: float) -> None:
    """Nor beside one that was read so."""
    for content in ({"a": number}, {"a": [number]}, {**json_text.parse(b'{"b":1e999}'), "a": number}):
        for indent in (None, 2):
            with pytest.raises(FormatError, match="JSON"):
                json_text.dump(content, indent)
