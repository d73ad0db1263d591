"""Common roots of nodes against walks along the parents; many skins share one search."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.check import checked_file
from tests.anim.check.cases import checked, edited
from tests.calls import count_calls


def _append_forest(json: dict[str, Any], parents: list[int]) -> None:
    """Append nodes below each other to a document. parents: of each, −1 for roots."""
    first = len(json["nodes"])
    for i in range(len(parents)):
        children = [first + k for k, parent in enumerate(parents) if parent == i]
        json["nodes"].append({"children": children} if children else {})


def test_common_roots_are_those_of_walks(monkeypatch: pytest.MonkeyPatch) -> None:
    chance = np.random.default_rng(3)
    parents = [int(chance.integers(-1, i)) if i % 5 else -1 for i in range(40)]
    file = checked(edited(lambda json: _append_forest(json, parents)))
    searches = count_calls(monkeypatch, checked_file, "find_subtrees")

    def root(node: int) -> int:
        above = int(file.skeleton.parents[node])
        return node if above < 0 else root(above)

    for _ in range(200):
        nodes = chance.integers(0, len(file.skeleton), chance.integers(1, 4)).tolist()
        assert file.have_common_root(nodes) == (len(set(map(root, nodes))) == 1)
    assert len(searches) == 1
