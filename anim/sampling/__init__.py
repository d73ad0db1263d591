"""Sampling: frame times, tracks, poses, world matrices."""

from anim.sampling.pose import PoseSampler, rest_pose, rest_world, sample_pose
from anim.sampling.times import frame_times
from anim.sampling.world import world_matrices

__all__ = ["PoseSampler", "frame_times", "rest_pose", "rest_world", "sample_pose", "world_matrices"]
