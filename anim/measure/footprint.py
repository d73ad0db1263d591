"""What animations cost: the bytes of their numbers, and of the JSON that describes them."""

from __future__ import annotations

import json as jsonlib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from anim.gltf import layout
from anim.gltf.document import Document, Json, items
from anim.gltf.references import views_of


@dataclass(frozen=True, slots=True)
class Footprint:
    """Bytes of stored numbers (decoded size where compressed), and of JSON: channels, samplers, accessors, views."""

    data: int
    json: int

    @property
    def total(self) -> int:
        """Both together."""
        return self.data + self.json


def of_all(document: Document, parts: Sequence[Footprint]) -> Footprint:
    """Return what all animations cost together, from what each costs alone: shared accessors and views count once."""
    content = document.json
    users = Counter(number for i in range(len(parts)) for number in _accessors_of(content, [i]))
    accessors, views = items(content, "accessors"), items(content, "bufferViews")
    extra = [(accessors[number], count - 1) for number, count in users.items() if count > 1]
    of_views = Counter(
        view
        for i in range(len(parts))
        for view in {v for n in _accessors_of(content, [i]) for v in views_of(accessors[n])}
    )
    repeated = [(views[view], count - 1) for view, count in of_views.items() if count > 1]
    data = sum(part.data for part in parts) - sum(_size(about) * times for about, times in extra)
    text = sum(part.json for part in parts) - sum((len(_text(about)) + 1) * times for about, times in extra + repeated)
    return Footprint(data, text)


def footprint(document: Document, animations: Sequence[int]) -> Footprint:
    """Return what the animations with these numbers cost together; what they share counts once."""
    content = document.json
    chosen = [items(content, "animations")[i] for i in animations]
    accessors = [items(content, "accessors")[i] for i in sorted(_accessors_of(content, animations))]
    views = {view for accessor in accessors for view in views_of(accessor)}
    described = [chosen, accessors, [items(content, "bufferViews")[i] for i in sorted(views)]]
    text = sum(len(_text(part)) - 1 for part in described if part)
    return Footprint(sum(map(_size, accessors)), text)


def _accessors_of(content: Json, animations: Iterable[int]) -> set[int]:
    found = items(content, "animations")
    return {sampler[key] for i in animations for sampler in found[i]["samplers"] for key in ("input", "output")}


def _text(part: object) -> str:
    return _encoder.encode(part)


_encoder = jsonlib.JSONEncoder(separators=(",", ":"), ensure_ascii=False, check_circular=False)


def _size(accessor: Json) -> int:
    if accessor["type"] not in layout.COMPONENTS or not views_of(accessor):
        return 0
    return int(accessor["count"]) * layout.element_size(accessor["componentType"], accessor["type"])
