"""Groups at the roots of scenes that hide and show baked meshes as the nodes above them did (KHR_node_visibility)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from anim.caches.formats.flipbook_keys import VISIBILITY, visibility_target
from anim.caches.source_document.bake_source import baked_name
from anim.gltf.document import Json
from anim.gltf.validation.channel_targets import channel_target

_POINTER = re.compile(rf"/nodes/(0|[1-9][0-9]{{0,8}})/extensions/{VISIBILITY}/visible")


@dataclass(slots=True)
class VisibilityGroups:
    """Groups of an edited document, one below another for each node above a mesh that can hide it.

    A mesh in world space is no longer below these nodes, whose transforms would move it; a node is visible if it and
    all above it are. nodes: of the edited JSON. parents: of the source's nodes.
    """

    nodes: list[Json]
    parents: Sequence[int]
    _copies: dict[int, list[int]] = field(default_factory=dict)  # groups by the node that they stand for
    _made: dict[tuple[int, ...], tuple[int, int]] = field(default_factory=dict)  # outermost and innermost group

    def place(self, node: int, above: int) -> int:
        """Put a node into the groups for `above` and all nodes above that one; return the node to make a root."""
        hiding = tuple(each for each in self._ancestors(above) if VISIBILITY in self.nodes[each].get("extensions", {}))
        if not hiding:
            return node
        if hiding not in self._made:
            self._made[hiding] = self._add(hiding)
        outermost, innermost = self._made[hiding]
        self.nodes[innermost]["children"].append(node)
        return outermost

    def channels(self, channels: Iterable[Json]) -> list[Json]:
        """Return channels that hide and show the groups as these channels hide and show the nodes above."""
        found = []
        for channel in channels:
            target = channel_target(channel)
            match = _POINTER.fullmatch((target and target[2]) or "")
            copies = self._copies.get(int(match[1]), ()) if match else ()
            found += [{**channel, "target": visibility_target(group)} for group in copies]
        return found

    def _ancestors(self, node: int) -> list[int]:
        """The node, and all above it."""
        found = []
        while node >= 0:
            found.append(node)
            node = self.parents[node]
        return found

    def _add(self, hiding: Sequence[int]) -> tuple[int, int]:
        """Append a group for each node, the first one innermost."""
        first = len(self.nodes)
        for i, node in enumerate(hiding):
            same = {VISIBILITY: self.nodes[node]["extensions"][VISIBILITY]}
            name = baked_name({"nodes": self.nodes}, node)
            self.nodes.append({"name": name, "children": [first + i - 1] if i else [], "extensions": same})
            self._copies.setdefault(node, []).append(first + i)
        return len(self.nodes) - 1, first
