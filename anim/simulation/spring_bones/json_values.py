"""Values that several JSON forms of spring bones share: shapes of colliders, and positions of errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ParamSpec, TypeVar

from anim.errors import AnimError, FormatError, NotFoundError
from anim.gltf.document import Json
from anim.gltf.validation.rules import Check, ObjectRule, boolean, number, numbers
from anim.simulation.spring_bones.colliders import FORWARD, ORIGIN, Collider, ColliderShape

P = ParamSpec("P")
T = TypeVar("T")

_SPHERE: dict[str, Check] = {"offset": numbers(3), "radius": number}
_CAPSULE: dict[str, Check] = {**_SPHERE, "tail": numbers(3)}
PLAIN_SHAPES: dict[str, Check] = {"sphere": ObjectRule(_SPHERE), "capsule": ObjectRule(_CAPSULE)}
EXTENDED_SHAPES: dict[str, Check] = {
    "sphere": ObjectRule({**_SPHERE, "inside": boolean}),
    "capsule": ObjectRule({**_CAPSULE, "inside": boolean}),
    "plane": ObjectRule({"offset": numbers(3), "normal": numbers(3)}),
}


def one_of_shapes(shapes: Mapping[str, Check]) -> ObjectRule:
    """Return the check of an object with exactly one of these shapes."""

    def check_one(value: Json) -> None:
        found = [key for key in value if key in shapes]
        if len(found) != 1:
            raise FormatError(f"has {' and '.join(found) or 'no shape'} (expected one of {', '.join(shapes)})")

    return ObjectRule(shapes, whole=check_one)


def parse_shape(value: Json, node: int | None, name: str = "") -> Collider:
    """Return the collider of a checked object such as {"sphere": {"radius": 0.1}}."""
    kind = next(key for key in value if key in EXTENDED_SHAPES)
    about = value[kind]
    return Collider(
        node,
        ColliderShape(kind),
        offset=about.get("offset", ORIGIN),
        tail=about.get("tail", ORIGIN),
        normal=about.get("normal", FORWARD),
        radius=about.get("radius", 0.0),
        inside=about.get("inside", False),
        name=name,
    )


def count_items(value: Json, key: str) -> int:
    """Return the length of an array that may be missing, or be something else that its own check reports."""
    items = value.get(key)
    return len(items) if isinstance(items, list) else 0


class JointSprings:
    """The spring of each joint that a file lists. nodes: the file's JSON.

    Joints are added before their chains are built: a file can list one chain of a thousand joints a thousand times.
    """

    def __init__(self, nodes: Sequence[Json]) -> None:
        self._nodes = nodes
        self._springs: dict[int, str] = {}

    def add(self, node: int, spring: str) -> None:
        """Add a joint by its node. spring: its position in the JSON. Raises FormatError for a joint of two springs."""
        if node in self._springs:
            other, name = self._springs[node], self._nodes[node].get("name", "")
            label = f"node {node} '{name}'" if name else f"node {node}"
            words = f"a joint of {other} too" if other != spring else "a joint twice"
            raise FormatError(f"{label} is {words} (expected one spring for each joint)", where=spring)
        self._springs[node] = spring


def locate(where: str, make: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Return what `make` returns; its errors become FormatErrors at `where`, since the values are those of a file.

    Missing nodes stay NotFoundErrors.
    """
    try:
        return make(*args, **kwargs)
    except NotFoundError as error:
        raise error.at(where, _separator(error)) from None
    except AnimError as error:
        raise FormatError(error.problem, where=error.where, help=error.help).at(where, _separator(error)) from None


def _separator(error: AnimError) -> str:
    return "" if not error.where or error.where.startswith("[") else "."
