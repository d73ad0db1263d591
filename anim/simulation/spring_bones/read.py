"""Spring bones that a file states: VRMC_springBone 1.0, or secondaryAnimation of VRM 0.x."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

from anim.errors import AnimError, NotFoundError
from anim.gltf.document import Document, Json
from anim.simulation.spring_bones import vrm0, vrm1
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.colliders import Collider

T = TypeVar("T")
SPRING_READERS = {vrm1.EXTENSION: vrm1.read, vrm0.EXTENSION: vrm0.read}
COLLIDER_READERS = {vrm1.EXTENSION: vrm1.read_colliders, vrm0.EXTENSION: vrm0.read_colliders}


def read_spring_bones(document: Document) -> SpringBones:
    """Return the chains and colliders that a file states; VRM 1.0 is preferred where it has both.

    Raises NotFoundError if it states none, FormatError with the position in the JSON if they are invalid.
    """
    for bones in _read_all(document, SPRING_READERS):
        if bones.chains:
            return bones
    raise NotFoundError(
        "the file has no spring bones (neither VRMC_springBone nor VRM 0.x secondaryAnimation)",
        help="`chain` names the first joint of each chain, such as 'Tail*'",
    )


def read_colliders(document: Document) -> tuple[Collider, ...]:
    """Return the colliders of a file's spring bones, whose chains are left out. Raises as `read_spring_bones`."""
    for colliders in _read_all(document, COLLIDER_READERS):
        if colliders:
            return colliders
    raise NotFoundError("the file has no colliders (neither VRMC_springBone nor VRM 0.x secondaryAnimation)")


def _read_all(document: Document, readers: Mapping[str, Callable[[Any, Json], T]]) -> Iterator[T]:
    extensions = document.json.get("extensions")
    for name, read in readers.items():
        if isinstance(extensions, dict) and name in extensions:
            try:
                yield read(extensions[name], document.json)
            except AnimError as error:
                raise error.at(f"extensions.{name}", "." if error.where[:1].isalpha() else "") from None
