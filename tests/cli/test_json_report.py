"""JSON of reports: indented for readers, a single line where only programs read it."""

from __future__ import annotations

import json

import pytest

from anim.errors import FormatError
from cli.reports import json_report


def test_long_reports_are_a_single_line_of_the_same_content() -> None:
    def report(count: int) -> dict[str, object]:
        clips = [{"name": "jämn", "keys": [1, 2.5], "share": None} for _ in range(count)]
        return {"schema": 1, "clips": tuple(clips)}

    longest = json_report.MAX_INDENTED_VALUES
    short, long = (json_report.dump(report(count)) for count in (2, longest // 6 + 1))
    assert short.startswith('{\n "schema": 1,\n "clips": [\n  {\n   "name": "jämn",')
    assert long.count("\n") == 1
    assert long.endswith("}\n")
    assert "jämn" in long
    assert json.loads(long) == json.loads(json.dumps(report(longest // 6 + 1)))
    assert json_report.dump(report(longest // 6 - 2)).count("\n") > longest


@pytest.mark.parametrize("count", [1, json_report.MAX_INDENTED_VALUES])
def test_a_function_stands_for_what_it_returns(count: int) -> None:
    called, plain = ({"clips": [make({"name": "a", "keys": [1, 2.5]})] * count} for make in (_returning, _itself))
    assert json_report.dump(called) == json_report.dump(plain)


def test_a_number_that_json_has_no_form_for_is_found_in_what_a_function_returns() -> None:
    with pytest.raises(FormatError, match=r"clips\[1\]\.mean is inf"):
        json_report.dump({"clips": [{}, _returning({"mean": float("inf")})]})


def _itself(value: object) -> object:
    return value


def _returning(value: object) -> object:
    return lambda: value
