"""JSON text: what was laid out stays laid out, and everything comes back."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from anim.errors import FormatError
from anim.gltf import text

LEAVES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
VALUES = st.recursive(LEAVES, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8)


@given(st.dictionaries(st.text(), VALUES), st.sampled_from([None, 1, 2, 4]))
def test_everything_comes_back_in_its_order(content: dict[str, Any], indent: int | None) -> None:
    back = text.parse(text.dump(content, indent))
    assert json.dumps(back) == json.dumps(content)


def test_layout_by_hand() -> None:
    content = {"a": [1, 2.5], "b": {}, "c": [{"d": "é"}, []], "e": []}
    assert text.dump(content) == '{"a":[1,2.5],"b":{},"c":[{"d":"é"},[]],"e":[]}'.encode()
    assert text.dump(content, 2).decode() == (
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
    assert text.indent_of(raw) == indent


def test_a_lone_surrogate_survives_as_an_escape() -> None:
    raw = b'{"name":"\\ud800"}'
    assert text.dump(text.parse(raw)) == raw
    assert json.loads(text.dump(text.parse(raw), 2)) == json.loads(raw)


@pytest.mark.parametrize("raw", [b'{"a":NaN}', b'{"a":Infinity}', b'{"a":-Infinity}', b"[1]", b"1", b"null", b"", b"{"])
def test_what_is_no_json_object_is_refused(raw: bytes) -> None:
    with pytest.raises(FormatError, match="JSON"):
        text.parse(raw)


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_what_json_can_not_hold_is_refused(number: float) -> None:
    for indent in (None, 2):
        with pytest.raises(FormatError, match="JSON"):
            text.dump({"a": number}, indent)
