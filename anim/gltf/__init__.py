"""The only room with glTF bytes: container, accessors, reading and writing."""

from anim.gltf.document import Document

__all__ = ["Document"]
