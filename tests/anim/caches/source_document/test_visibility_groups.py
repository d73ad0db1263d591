"""Groups in place of nodes that hide meshes."""

from __future__ import annotations

import numpy as np

from anim.caches.formats.flipbook_keys import VISIBILITY, visibility_target
from anim.caches.source_document.visibility_groups import VisibilityGroups
from anim.gltf.document import Json


def test_each_node_that_hides_has_one_group_below_that_of_the_next() -> None:
    """A chain of 40: a group for each mesh and node above it would be 400."""
    count = 40
    nodes: list[Json] = [{"extensions": {VISIBILITY: {"visible": i > 3}}} if i % 2 else {} for i in range(count)]
    groups = VisibilityGroups(nodes, np.arange(-1, count - 1))
    roots = set()
    for above in reversed(range(count)):
        nodes.append({"name": f"mesh {above}"})
        roots.add(groups.place(len(nodes) - 1, above))
    made = [i for i, node in enumerate(nodes) if i >= count and "extensions" in node]
    assert len(made) == count // 2
    assert len(roots) == 2  # the mesh of node 0, which nothing hides, and the group of node 1
    parent = {child: i for i, node in enumerate(nodes) for child in node.get("children", ())}
    for i, node in enumerate(nodes[count:], count):
        if "extensions" in node:
            continue
        hiding = []
        while (i := parent.get(i, -1)) >= 0:
            hiding.append(nodes[i]["extensions"])
        above = int(node["name"].split()[1])
        expected = [nodes[each]["extensions"] for each in range(above, -1, -1) if each % 2]
        assert hiding == expected
    shown: Json = {"sampler": 0, "target": visibility_target(5)}
    (channel,) = groups.channels([shown, {"sampler": 1, "target": {"node": 5, "path": "rotation"}}])
    assert channel["target"]["extensions"] != shown["target"]["extensions"]
    assert channel["sampler"] == 0
