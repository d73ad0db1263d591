"""Track: one animated property: its key times, its values, how to go from key to key, and how it is stored."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from anim import arrays
from anim.arrays import Floats
from anim.errors import ShapeError

PATHS = ("translation", "rotation", "scale", "weights")
WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}  # components per key; weights and pointers have their own


class Interpolation(StrEnum):
    """What lies between two keys, by glTF's names."""

    STEP = "STEP"
    LINEAR = "LINEAR"
    CUBICSPLINE = "CUBICSPLINE"


class Kind(StrEnum):
    """What a value is, hence how it may be interpolated."""

    VECTOR = "vector"  # component by component
    ROTATION = "rotation"  # unit quaternion (x, y, z, w)
    DISCRETE = "discrete"  # bool or integer: STEP only


@dataclass(frozen=True, slots=True)
class Storage:
    """How a file holds values: glTF's component type, whether integers mean fractions, and the element type.

    element: "SCALAR", "VEC3", …; None where the path says it all.
    """

    component_type: int = 5126
    normalized: bool = False
    element: str | None = None


FLOAT32 = Storage()


@dataclass(frozen=True, slots=True)
class Track:
    """Keys of one property of one node, or of anything that a JSON pointer names.

    path: "translation", "rotation", "scale" or "weights" of `node`; "pointer" where the target is no node property.
    times: (K,) seconds, ≥ 0, strictly increasing.
    values: (K, C) metres, unit quaternion (x, y, z, w), factor, weight, or the pointer's own unit.
    in_tangents, out_tangents: (K, C) per second, for CUBICSPLINE and only there.
    pointer: the target by KHR_animation_pointer; `node` and `path` say the same where it names a node's property.
    storage: how the file held the values; writers use it again where it holds the new ones exactly.
    """

    node: int | None
    path: str
    interpolation: Interpolation
    times: Floats
    values: Floats
    in_tangents: Floats | None = None
    out_tangents: Floats | None = None
    pointer: str | None = None
    storage: Storage = field(default=FLOAT32)

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        times, values = arrays.times(self.times), arrays.floats(self.values, "K C", name="values")
        set_field(self, "times", times)
        set_field(self, "values", values)
        shape = (len(times), WIDTHS.get(self.path, int(values.shape[1])))
        if values.shape != shape:
            raise ShapeError(f"values have shape {values.shape} (expected {shape})")
        cubic = self.interpolation is Interpolation.CUBICSPLINE
        if (self.in_tangents is not None) is not cubic or (self.out_tangents is not None) is not cubic:
            raise ShapeError(f"{self.interpolation} with {'one or no' if cubic else 'in or out'} tangents")
        if self.in_tangents is not None and self.out_tangents is not None:
            set_field(self, "in_tangents", _tangents(self.in_tangents, shape, "in tangents"))
            set_field(self, "out_tangents", _tangents(self.out_tangents, shape, "out tangents"))

    @property
    def target(self) -> tuple[int | None, str]:
        """What this track moves, comparable: (node, path), or (None, pointer)."""
        return (None, self.pointer or "") if self.path == "pointer" else (self.node, self.path)

    @property
    def kind(self) -> Kind:
        """How values may be interpolated: see `kind_of`."""
        return kind_of(self)


def _tangents(values: Floats, shape: tuple[int, int], name: str) -> Floats:
    tangents = arrays.floats(values, "K C", name=name)
    if tangents.shape != shape:
        raise ShapeError(f"{name} have shape {tangents.shape} (expected {shape})")
    return tangents


def kind_of(track: Track) -> Kind:
    """Return what the values of `track` are.

    A pointer that ends in "/rotation" and has four components is a quaternion; integers that are not normalized
    under STEP are bools or integers of the object model (KHR_animation_pointer allows nothing else for those).
    """
    if track.path == "rotation":
        return Kind.ROTATION
    if track.pointer is None:
        return Kind.VECTOR
    if track.pointer.endswith("/rotation") and track.values.shape[1] == 4:
        return Kind.ROTATION
    integers = track.storage.component_type != 5126 and not track.storage.normalized
    return Kind.DISCRETE if integers and track.interpolation is Interpolation.STEP else Kind.VECTOR
