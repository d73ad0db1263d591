"""Time to value: frames, tracks, poses, world matrices."""

from anim.sampling.pose import pose, rest, world_matrices
from anim.sampling.times import grid
from anim.sampling.track import sample

__all__ = ["grid", "pose", "rest", "sample", "world_matrices"]
