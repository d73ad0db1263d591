"""The sources of node constraints, of any JSON."""

from __future__ import annotations

from typing import Any

import pytest

from anim.gltf.reading.node_constraints import CONSTRAINT, constraint_sources, rest_pose_extensions


@pytest.mark.parametrize(
    ("constraint", "expected"),
    [
        ({"roll": {"source": 2, "rollAxis": "X"}}, {2}),
        ({"aim": {"source": 2, "aimAxis": "PositiveX"}}, {0, 1, 2, 3}),
        ({"rotation": {"source": 9}}, set()),
        ({"rotation": {"source": "2"}}, set()),
        ({"rotation": []}, set()),
        ([], set()),
    ],
)
def test_sources(constraint: Any, expected: set[int]) -> None:
    nodes: list[dict[str, Any]] = [{"children": [1]}, {"children": [2]}, {}]
    nodes.append({"extensions": {CONSTRAINT: {"specVersion": "1.0", "constraint": constraint}}})
    assert constraint_sources({"nodes": nodes}) == expected


def test_a_constraint_that_is_not_declared_depends_on_the_rest_pose_too() -> None:
    assert rest_pose_extensions({"nodes": [{}, {"extensions": {CONSTRAINT: {}}}]}) == [CONSTRAINT]
    assert rest_pose_extensions({"nodes": [{}]}) == []
