"""Groups at the roots of scenes that hide and show baked meshes as the nodes above them did (KHR_node_visibility)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Ints
from anim.caches.formats.flipbook_keys import VISIBILITY, visibility_target
from anim.caches.source_document.bake_source import baked_name
from anim.gltf.document import Json
from anim.gltf.validation.channel_targets import channel_target
from anim.model.skeleton import nearest_at_or_above

_POINTER = re.compile(rf"/nodes/(0|[1-9][0-9]{{0,8}})/extensions/{VISIBILITY}/visible")


@dataclass(slots=True)
class VisibilityGroups:
    """Groups of an edited document, one for each node above a mesh that can hide it, below one another as these are.

    A mesh in world space is no longer below these nodes, whose transforms would move it; a node is visible if it and
    all above it are. nodes: of the edited JSON. parents: (N,) of the source's nodes.
    """

    nodes: list[Json]
    parents: Ints
    _hiding: Ints = field(init=False)  # (N + 1,) the nearest node that can hide each, itself or above it, else −1
    _groups: dict[int, int] = field(default_factory=dict)  # by the node that each stands for
    _outermost: dict[int, int] = field(default_factory=dict)  # by the same, the group at the root

    def __post_init__(self) -> None:
        """Find the nodes that hide each node."""
        can_hide = [VISIBILITY in node.get("extensions", {}) for node in self.nodes[: len(self.parents)]]
        self._hiding = np.append(nearest_at_or_above(self.parents, np.array(can_hide, np.bool_)), -1)

    def place(self, node: int, above: int) -> int:
        """Put a node into the groups for `above` and all nodes above that one; return the node to make a root."""
        hiding = int(self._hiding[above])
        if hiding < 0:
            return node
        self._add_missing(hiding)
        self.nodes[self._groups[hiding]]["children"].append(node)
        return self._outermost[hiding]

    def channels(self, channels: Iterable[Json]) -> list[Json]:
        """Return channels that hide and show the groups as these channels hide and show the nodes above."""
        found = []
        for channel in channels:
            target = channel_target(channel)
            match = _POINTER.fullmatch((target and target[2]) or "")
            if match and (group := self._groups.get(int(match[1]))) is not None:
                found.append({**channel, "target": visibility_target(group)})
        return found

    def _add_missing(self, hiding: int) -> None:
        """Append the groups of a node and of those that hide it, which are not there yet."""
        missing = []
        while hiding >= 0 and hiding not in self._groups:
            missing.append(hiding)
            hiding = int(self._hiding[self.parents[hiding]])
        for each in reversed(missing):
            group = len(self.nodes)
            if hiding >= 0:
                self.nodes[self._groups[hiding]]["children"].append(group)
            same = {VISIBILITY: self.nodes[each]["extensions"][VISIBILITY]}
            name = baked_name({"nodes": self.nodes}, each)
            self.nodes.append({"name": name, "children": [], "extensions": same})
            self._groups[each], self._outermost[each] = group, self._outermost.get(hiding, group)
            hiding = each
