"""Text of reports is that of Python's own encoder."""

from __future__ import annotations

import io
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cli.reports import json_report
from cli.reports.indented_json import IndentedJson
from tests.calls import count_calls

SINGLE = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
VALUES = st.recursive(
    SINGLE, lambda inner: st.lists(inner) | st.tuples(inner, inner) | st.dictionaries(st.text(), inner), max_leaves=30
)


@given(VALUES, st.integers(0, 3))
def test_any_value(content: object, indent: int) -> None:
    text = io.StringIO()
    IndentedJson(text.write, indent).value(content)
    assert text.getvalue() == json.dumps(content, ensure_ascii=False, indent=indent)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_that_are_not_finite(value: float) -> None:
    for content in (value, [1, value], {"a": [{}, {"b": value}]}):
        with pytest.raises(ValueError, match="JSON"):
            IndentedJson(io.StringIO().write, 1).value(content)


def test_items_without_items_are_encoded_together(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = count_calls(monkeypatch, json.JSONEncoder, "encode")
    json_report.dump({"clips": [{str(key): key for key in range(30)} for _ in range(10)]})
    assert len(pieces) <= 10 + 1
