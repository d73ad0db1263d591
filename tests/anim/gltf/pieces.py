"""A file of one triangle, for tests of scenes."""

from __future__ import annotations

from typing import Any

from fixtures.broken.pieces import buffered

Json = dict[str, Any]

FLOAT = 5126
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def triangle(*, node: Json | None = None, mesh: Json | None = None, targets: int = 0) -> Json:
    """Return a file of one triangle."""
    content = buffered(("VEC3", FLOAT, CORNERS))
    primitive: Json = {"attributes": {"POSITION": 0}} | ({"targets": [{"POSITION": 0}] * targets} if targets else {})
    content["nodes"] = [{"mesh": 0, **(node or {})}]
    content["meshes"] = [{"primitives": [primitive], **(mesh or {})}]
    return content
