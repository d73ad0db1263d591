"""What the tests of `inspect` share: the facts about one file, and clips by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.cli.conftest import Call

Json = dict[str, Any]


def only(call: Call, data: bytes | Path, *options: str) -> Json:
    """Return the facts about one file, given as its bytes or its path."""
    run = call("inspect", "-", *options, "--format", "json", stdin=data) if isinstance(data, bytes) else None
    document = (run or call("inspect", str(data), *options, "--format", "json")).json
    assert document["schema"] == 1
    (facts,) = document["files"]
    found: Json = facts
    return found


def by_name(facts: Json) -> dict[str, Json]:
    """Return the facts about each clip, by its name."""
    return {clip["name"]: clip for clip in facts["clips"]}
