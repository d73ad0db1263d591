"""Files of many nodes, joints and meshes, through commands whose work once grew with their square."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import many
from tests.cli.conftest import Call
from tests.cli.test_many import LIMIT, work

CASES = [
    (many.joints, 500, "inspect"),  # ancestors of every joint, twice: 2 GB of sets for 8000
]


@pytest.mark.parametrize(("make", "count", "command"), CASES, ids=lambda each: getattr(each, "__name__", str(each)))
def test_work_grows_with_the_count(make: many.Make, count: int, command: str, call: Call, tmp_path: Path) -> None:
    taken = []
    for number in (count, 3 * count):
        (tmp_path / f"{number}.glb").write_bytes(make(number))
        taken.append(work(call, command, tmp_path / f"{number}.glb"))
    assert taken[1] < LIMIT * taken[0]
