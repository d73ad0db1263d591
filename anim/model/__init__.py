"""Immutable values with their invariants, and no algorithms."""

from anim.model.clip import Clip
from anim.model.pose import Pose
from anim.model.scene import Instance, Mesh, Primitive, Scene, Skin
from anim.model.skeleton import Skeleton
from anim.model.track import FLOAT32, Interpolation, Kind, Storage, Track
from anim.model.vertex_cache import Chunk, Part, VertexCache

__all__ = [
    "FLOAT32",
    "Chunk",
    "Clip",
    "Instance",
    "Interpolation",
    "Kind",
    "Mesh",
    "Part",
    "Pose",
    "Primitive",
    "Scene",
    "Skeleton",
    "Skin",
    "Storage",
    "Track",
    "VertexCache",
]
