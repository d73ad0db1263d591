"""JSON of reports: indented for readers, a single line where only programs read it."""

from __future__ import annotations

import json

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
