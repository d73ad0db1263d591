"""Immutable data classes with their invariants, without algorithms."""

from anim.model.clip import Clip
from anim.model.pose import Pose
from anim.model.scene import Mesh, MeshInstance, PrimitiveRange, Scene, Skin
from anim.model.skeleton import Skeleton
from anim.model.track import FLOAT32, AccessorFormat, Interpolation, Track, ValueKind
from anim.model.vertex_cache import FrameChunk, MeshPart, VertexCache

__all__ = [
    "FLOAT32",
    "AccessorFormat",
    "Clip",
    "FrameChunk",
    "Interpolation",
    "Mesh",
    "MeshInstance",
    "MeshPart",
    "Pose",
    "PrimitiveRange",
    "Scene",
    "Skeleton",
    "Skin",
    "Track",
    "ValueKind",
    "VertexCache",
]
