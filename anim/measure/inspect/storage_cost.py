"""Storage cost of animations: bytes of their values, and of the JSON for them."""

from __future__ import annotations

import json as jsonlib
from collections import Counter
from itertools import chain
from typing import NamedTuple

from anim.gltf.document import Document, Json, json_array
from anim.gltf.writing.references import sampled_accessors, views_of_all
from anim.measure.inspect.stored_bytes import stored_bytes, value_bytes


class StorageCost(NamedTuple):
    """Bytes of stored values (compressed: decoded), and of JSON: channels, samplers, accessors, views."""

    data: int
    json: int

    @property
    def total(self) -> int:
        """Bytes of both."""
        return self.data + self.json


def animation_bytes(document: Document) -> int:
    """Return the bytes of all animations: keys as stored, and JSON."""
    return stored_bytes(document) + _json_bytes(document.json)


def _json_bytes(content: Json) -> int:
    """Bytes of the JSON of all animations, as in `storage_costs`: a comma after each object."""
    accessors, views = json_array(content, "accessors"), json_array(content, "bufferViews")
    animations = json_array(content, "animations")
    samplers = [sampler for animation in animations for sampler in animation["samplers"]]
    named = [accessors[i] for i in sampled_accessors(samplers)]
    parts = animations, named, [views[i] for i in views_of_all(named)]
    return sum(len(_text(part)) - 1 for part in parts if part)


def storage_costs(document: Document) -> tuple[list[StorageCost], StorageCost]:
    """Return the cost of each animation alone, and of all together, where shared data counts once."""
    content = document.json
    accessors, views = json_array(content, "accessors"), json_array(content, "bufferViews")
    alone: list[StorageCost] = []
    used: dict[tuple[int, ...], tuple[int, int, set[int]]] = {}  # by accessors: data, JSON, and views
    num_users: Counter[tuple[int, ...]] = Counter()
    for animation in json_array(content, "animations"):
        numbers = tuple(sorted(sampled_accessors(animation["samplers"])))
        if numbers not in used:
            named = [accessors[i] for i in numbers]
            of_views = views_of_all(named)
            described = [named, [views[i] for i in sorted(of_views)]]
            text = sum(len(_text(part)) - 1 for part in described if part)
            used[numbers] = sum(map(_size, named)), text, of_views
        data, text, _ = used[numbers]
        alone.append(StorageCost(data, len(_text(animation)) + 1 + text))
        num_users[numbers] += 1
    users_of_accessor = Counter(chain.from_iterable(numbers * count for numbers, count in num_users.items()))
    users_of_view = Counter(chain.from_iterable([*used[numbers][2]] * count for numbers, count in num_users.items()))
    extra = [(accessors[i], count - 1) for i, count in users_of_accessor.items() if count > 1]
    repeated = [(views[i], count - 1) for i, count in users_of_view.items() if count > 1]
    data = sum(part.data for part in alone) - sum(_size(about) * times for about, times in extra)
    text = sum(part.json for part in alone) - sum((len(_text(about)) + 1) * times for about, times in extra + repeated)
    return alone, StorageCost(data, text)


def _text(part: object) -> str:
    return _encoder.encode(part)


_encoder = jsonlib.JSONEncoder(separators=(",", ":"), ensure_ascii=False, check_circular=False)


def _size(accessor: Json) -> int:
    return value_bytes(accessor) if "bufferView" in accessor or "sparse" in accessor else 0
