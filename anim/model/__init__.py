"""Immutable data classes with their invariants, without algorithms."""

from typing import TYPE_CHECKING

from anim.model.clip import Clip
from anim.model.morphed_node import MorphedNode, WeightPointer, parse_weight_pointer
from anim.model.pose import Pose
from anim.model.scene import Mesh, MeshInstance, PrimitiveRange, Scene, Skin
from anim.model.skeleton import Skeleton
from anim.model.time_axis import TimeAxis
from anim.model.track import FLOAT32, AccessorFormat, Interpolation, Track, ValueKind

if TYPE_CHECKING:  # imported on first use: only bakes and caches need them
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
    "MorphedNode",
    "Pose",
    "PrimitiveRange",
    "Scene",
    "Skeleton",
    "Skin",
    "TimeAxis",
    "Track",
    "ValueKind",
    "VertexCache",
    "WeightPointer",
    "parse_weight_pointer",
]


def __getattr__(name: str) -> object:
    if name not in ("FrameChunk", "MeshPart", "VertexCache"):
        raise AttributeError(f"module 'anim.model' has no attribute '{name}'")
    from anim.model import vertex_cache

    return getattr(vertex_cache, name)
