"""Spring bones that a file states: VRMC_springBone 1.0, or secondaryAnimation of VRM 0.x."""

from __future__ import annotations

from collections.abc import Iterator

from anim.errors import AnimError, NotFoundError
from anim.gltf.document import Document
from anim.simulation.spring_bones import vrm0, vrm1
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.colliders import Collider

READERS = {vrm1.EXTENSION: vrm1.read, vrm0.EXTENSION: vrm0.read}


def read_spring_bones(document: Document) -> SpringBones:
    """Return the chains and colliders that a file states; VRM 1.0 is preferred where it has both.

    Raises NotFoundError if it states none, FormatError with the position in the JSON if they are invalid.
    """
    for bones in _read_all(document):
        if bones.chains:
            return bones
    raise NotFoundError(
        "the file has no spring bones (neither VRMC_springBone nor VRM 0.x secondaryAnimation)",
        help="`chain` names the first joint of each chain, such as 'Tail*'",
    )


def read_colliders(document: Document) -> tuple[Collider, ...]:
    """Return the colliders of a file's spring bones, which may have no chains. Raises as `read_spring_bones`."""
    for bones in _read_all(document):
        if bones.colliders:
            return bones.colliders
    raise NotFoundError("the file has no colliders (neither VRMC_springBone nor VRM 0.x secondaryAnimation)")


def _read_all(document: Document) -> Iterator[SpringBones]:
    extensions = document.json.get("extensions")
    for name, read in READERS.items():
        if isinstance(extensions, dict) and name in extensions:
            try:
                yield read(extensions[name], document.json)
            except AnimError as error:
                raise error.at(f"extensions.{name}", "." if error.where[:1].isalpha() else "") from None
