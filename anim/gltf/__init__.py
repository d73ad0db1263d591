"""glTF files: container, validation, accessors, reading and writing."""

from anim.gltf.document import Document

__all__ = ["Document"]
