"""Storage cost of animations: bytes of their values, and of the JSON for them."""

from __future__ import annotations

import json as jsonlib
from collections import Counter
from typing import NamedTuple

from anim.gltf.document import Document, Json, json_array
from anim.gltf.validation import buffer_layout
from anim.gltf.writing.references import views_of


class StorageCost(NamedTuple):
    """Bytes of stored values (compressed: decoded), and of JSON: channels, samplers, accessors, views."""

    data: int
    json: int

    @property
    def total(self) -> int:
        """Bytes of both."""
        return self.data + self.json


def storage_costs(document: Document) -> tuple[list[StorageCost], StorageCost]:
    """Return the cost of each animation alone, and of all together, where shared data counts once."""
    content = document.json
    accessors, views = json_array(content, "accessors"), json_array(content, "bufferViews")
    alone: list[StorageCost] = []
    users_of_accessor: Counter[int] = Counter()
    users_of_view: Counter[int] = Counter()
    for animation in json_array(content, "animations"):
        numbers = {sampler[key] for sampler in animation["samplers"] for key in ("input", "output")}
        named = [accessors[i] for i in sorted(numbers)]
        of_views = {view for accessor in named for view in views_of(accessor)}
        described = [[animation], named, [views[i] for i in sorted(of_views)]]
        alone.append(StorageCost(sum(map(_size, named)), sum(len(_text(part)) - 1 for part in described if part)))
        users_of_accessor.update(numbers)
        users_of_view.update(of_views)
    extra = [(accessors[i], count - 1) for i, count in users_of_accessor.items() if count > 1]
    repeated = [(views[i], count - 1) for i, count in users_of_view.items() if count > 1]
    data = sum(part.data for part in alone) - sum(_size(about) * times for about, times in extra)
    text = sum(part.json for part in alone) - sum((len(_text(about)) + 1) * times for about, times in extra + repeated)
    return alone, StorageCost(data, text)


def _text(part: object) -> str:
    return _encoder.encode(part)


_encoder = jsonlib.JSONEncoder(separators=(",", ":"), ensure_ascii=False, check_circular=False)


def _size(accessor: Json) -> int:
    stored = "bufferView" in accessor or "sparse" in accessor
    if not stored or accessor["type"] not in buffer_layout.COMPONENTS:
        return 0
    return int(accessor["count"]) * buffer_layout.element_size(accessor["componentType"], accessor["type"])
