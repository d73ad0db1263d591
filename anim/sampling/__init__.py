"""Sampling: frame times, tracks, poses, world matrices."""

from anim.sampling.pose import rest_pose, sample_pose, world_matrices
from anim.sampling.times import frame_times

__all__ = ["frame_times", "rest_pose", "sample_pose", "world_matrices"]
