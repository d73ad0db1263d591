"""How far apart two files are, for tests: what `diff` says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.cli.conftest import Call


def apart(call: Call, a: Path, b: Path, *options: str) -> dict[str, Any]:
    """Return what `diff` says of two files that have the same clips."""
    found: dict[str, Any] = call("diff", a, b, "--format", "json", *options).json
    assert (found["missing_clips"], found["added_clips"]) == ([], [])
    return found
