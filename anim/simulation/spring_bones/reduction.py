"""Fewer keys for simulated rotations, within an error measured on the surface."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from anim.curves.fitting.key_reduction import greedy_keys
from anim.errors import RangeError
from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.model import Clip, Skeleton, Track
from anim.sampling import rest_world

MAX_TRIALS = 12
MIN_GAIN = 1.15  # a trial whose tolerance is nearer to the best one is not worth its time


def reduce_keys(prover: Prover, clip: Clip, joints: Collection[int], *, max_error: float) -> tuple[Clip, Proof]:
    """Return the clip with fewer keys in the rotation tracks of `joints`, and the largest error, both measured.

    prover: on the scene. max_error: m, > 0, that no vertex exceeds. All joints share one angular tolerance, scaled by
    their reach; it is searched by bisection. Keys that stay are unchanged.
    Raises RangeError for a `max_error` that isn't above 0.
    """
    if not max_error > 0:
        raise RangeError(f"`max_error` is {max_error:g} m (expected more than 0)")
    reach = _reaches(prover.ruler.scene.skeleton, joints)
    best, found = clip, largest_error(prover, clip, clip)
    low, high = 0.0, np.inf
    scale = 1.0
    for _ in range(MAX_TRIALS):
        trial = _reduced(clip, {node: scale * max_error / (len(reach) * each) for node, each in reach.items()})
        proof = largest_error(prover, clip, trial)
        if max(proof.error.max_error, proof.bound or 0.0) <= max_error:
            low, best, found = scale, trial, proof
        else:
            high = scale
        if high < MIN_GAIN * low:
            break
        scale = 2 * low if high == np.inf else np.sqrt(low * high) if low else high / 4
    return best, found


def _reaches(skeleton: Skeleton, joints: Collection[int]) -> dict[int, float]:
    """Distance in metres from each joint to the farthest node below, at least to its parent: a measure of its skin."""
    positions = rest_world(skeleton)[:, :, 3]
    reach = {}
    for node in joints:
        others = np.flatnonzero(skeleton.descendants(node))
        others = np.append(others, skeleton.parents[node]) if skeleton.parents[node] >= 0 else others
        reach[node] = max(float(np.linalg.norm(positions[others] - positions[node], axis=-1).max()), 1e-6)
    return reach


def _reduced(clip: Clip, tolerances: dict[int, float]) -> Clip:
    """The clip with the keys that keep rotations within an angle, in radians by node."""
    tracks = list(clip.tracks)
    for i, track in enumerate(tracks):
        if track.path == "rotation" and track.node in tolerances and len(track.times) > 2:
            tracks[i] = _fewer(track, tolerances[track.node])
    return Clip(clip.name, tuple(tracks))


def _fewer(track: Track, tolerance: float) -> Track:
    scaled = track.values / (tolerance / 2)  # an angle is twice the distance of quaternions
    keep = greedy_keys(scaled[None], track.times)[0]
    return track.with_keys(track.times[keep], track.values[keep])
