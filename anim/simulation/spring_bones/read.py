"""Spring bones that a file states: VRMC_springBone 1.0, or secondaryAnimation of VRM 0.x."""

from __future__ import annotations

from anim.errors import AnimError, NotFoundError
from anim.gltf.document import Document
from anim.simulation.spring_bones import vrm0, vrm1
from anim.simulation.spring_bones.chains import SpringBones

READERS = {vrm1.EXTENSION: vrm1.read, vrm0.EXTENSION: vrm0.read}


def read_spring_bones(document: Document) -> SpringBones:
    """Return the chains and colliders that a file states; VRM 1.0 is preferred where it has both.

    Raises NotFoundError if it states none, FormatError with the position in the JSON if they are invalid.
    """
    extensions = document.json.get("extensions")
    for name, read in READERS.items():
        if isinstance(extensions, dict) and name in extensions:
            try:
                bones = read(extensions[name], document.json)
            except AnimError as error:
                raise error.at(f"extensions.{name}", "." if error.where[:1].isalpha() else "") from None
            if bones.chains:
                return bones
    raise NotFoundError(
        "the file has no spring bones (neither VRMC_springBone nor VRM 0.x secondaryAnimation)",
        help="`chain` names the first joint of each chain, such as 'Tail*'",
    )
