"""JSON text: what was laid out stays laid out, and everything comes back."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from anim.errors import FormatError
from anim.gltf.io import json_text

TEXT = st.text(max_size=8)
LEAVES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | TEXT
VALUES = st.recursive(LEAVES, lambda inner: st.lists(inner) | st.dictionaries(TEXT, inner), max_leaves=8)


@given(st.dictionaries(TEXT, VALUES), st.sampled_from([None, 1, 2, 4]))
def test_everything_comes_back_in_its_order(content: dict[str, Any], indent: int | None) -> None:
    back = json_text.parse(json_text.dump(content, indent))
    assert json.dumps(back) == json.dumps(content)


def test_layout_by_hand() -> None:
    content = {"a": [1, 2.5], "b": {}, "c": [{"d": "é"}, []], "e": []}
    assert json_text.dump(content) == '{"a":[1,2.5],"b":{},"c":[{"d":"é"},[]],"e":[]}'.encode()
    assert json_text.dump(content, 2).decode() == (
        '{\n  "a": [\n    1,\n    2.5\n  ],\n  "b": {},\n'
        '  "c": [\n    {\n      "d": "é"\n    },\n    []\n  ],\n  "e": []\n}'
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


@pytest.mark.parametrize("literal", ["1e999", "-2.5E+400", "-1e309"])
def test_numbers_beyond_float64_are_refused(literal: str) -> None:
    with pytest.raises(FormatError, match=f"JSON holds a number too large for float64 .got {re.escape(literal)}"):
        json_text.parse(f'{{"extras":[{literal}]}}'.encode())


@pytest.mark.parametrize("raw", [b'{"a":NaN}', b'{"a":Infinity}', b'{"a":-Infinity}', b"[1]", b"1", b"null", b"", b"{"])
def test_what_is_no_json_object_is_refused(raw: bytes) -> None:
    with pytest.raises(FormatError, match="JSON"):
        json_text.parse(raw)


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_what_json_can_not_hold_is_refused(number: float) -> None:
    for content in ({"a": number}, {"a": [number]}):
        for indent in (None, 2):
            with pytest.raises(FormatError, match="JSON"):
                json_text.dump(content, indent)
