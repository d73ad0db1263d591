"""Time to value: frames, tracks, poses, world matrices."""

from anim.sampling.pose import pose, rest, world_matrices
from anim.sampling.times import grid

__all__ = ["grid", "pose", "rest", "world_matrices"]
