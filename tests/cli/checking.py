"""What tests of `check` share."""

from __future__ import annotations

from typing import Any


def codes(report: Any) -> set[str]:
    """Return the codes of the findings in a JSON report."""
    return {each["code"] for each in report["findings"]}
