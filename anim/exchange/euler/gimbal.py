"""Distance from gimbal lock for each joint, and the order with the greatest distance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.exchange.euler.equal_nodes import first_equal_rotations
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode, Pivots
from anim.maths import euler, quaternion
from anim.maths.euler import ORDERS, AxesConvention
from anim.model import Clip, Interpolation, Track
from anim.sampling.track_stack import TrackStack

COSINE_ROUNDING = 1e-12  # of `gimbal_cosine`, far above its rounding
NEAR_LOCK_RAD = np.radians(5.0)  # from lock: rates are amplified 23 times there
SUFFICIENT_KEYS, SAMPLES_PER_INTERVAL = 500, 29  # sufficient keys; samples per interval with fewer keys
ANGLE_TOLERANCE_RAD = 1e-9  # rad; smaller differences are ignored: the first counts
MAX_BATCH_QUATERNIONS = 50_000  # quaternions evaluated together
SAME_DISTANCE = {"XZX": "XYX", "YZY": "YXY", "ZYZ": "ZXZ"}  # locked where the first axis comes back to itself


@dataclass(frozen=True, slots=True)
class GimbalStats:
    """One joint under its own order.

    nearest_deg: minimum distance from lock, at time at_s. near_s: time within 5° of it.
    worst_condition: greatest ratio of singular values of the map from rates of angles to angular velocity; 1 is best.
    aligned: the two axes that align at lock. best_order: of all 12 (intrinsic, or extrinsic reversed) the one with the
    greatest minimum distance for this motion, best_nearest_deg.
    """

    node: str
    order: str
    frame: str
    nearest_deg: float
    at_s: float
    near_s: float
    worst_condition: float
    aligned: str
    best_order: str
    best_nearest_deg: float


def gimbal_stats(motion: EulerMotion, clip: Clip) -> tuple[GimbalStats, ...]:
    """Return the statistics of each node that rotates about three axes, in the order of nodes.

    clip: the motion as quaternions, with the motion's node indices. Its keys are evaluated; with few keys also times
    between them. Pre and post rotations are removed: the three angles are between them.
    Source: the Jacobian's singular values are 1, √(1 + s), √(1 − s), s the cosine of the distance from lock.
    """
    every = [track for track in clip.tracks if _has_lock(motion, track)]
    first = first_equal_rotations(motion, every)
    rows: dict[int | None, GimbalStats] = {}  # by node
    for tracks in _batches([every[i] for i in sorted(set(first))]):
        nodes = [motion.nodes[track.node] for track in tracks if track.node is not None]
        samples = _samples(tracks)
        turns = _without_pivots([node.pivots for node in nodes], samples)
        by_order = {order: _nearest(samples, turns, order) for order in ORDERS if order not in SAME_DISTANCE}
        by_order |= {order: by_order[other] for order, other in SAME_DISTANCE.items()}
        found = _rows(nodes, samples, turns, np.stack([by_order[order] for order in ORDERS]))
        rows |= zip((track.node for track in tracks), found, strict=True)
    pairs = sorted((track.node or 0, every[i].node) for track, i in zip(every, first, strict=True))
    return tuple(
        rows[other] if node == other else replace(rows[other], node=motion.nodes[node].name) for node, other in pairs
    )


def _has_lock(motion: EulerMotion, track: Track) -> bool:
    return track.path == "rotation" and track.node is not None and motion.nodes[track.node].order in ORDERS


class _Samples(NamedTuple):
    """Rotations (S, 4) of G tracks at times (S,) s, one track after the other.

    track: (S,) index of each sample's track. starts: (G,) index of the first sample of each.
    """

    track: Ints
    starts: Ints
    times: Floats
    rotations: Floats


def _batches(tracks: Sequence[Track]) -> Iterator[list[Track]]:
    """Yield the rotations to evaluate together, of one interpolation, sized for CPU caches."""
    groups: dict[tuple[Interpolation, bool], list[Track]] = {}
    for track in tracks:
        groups.setdefault((track.interpolation, _keys_suffice(track)), []).append(track)
    for (_, at_keys), group in groups.items():
        samples = np.array([len(track.times) for track in group]) * (1 if at_keys else SAMPLES_PER_INTERVAL + 1)
        batch = (np.cumsum(samples) - samples) // MAX_BATCH_QUATERNIONS
        bounds = np.flatnonzero(np.diff(batch, prepend=-1, append=-1)).tolist()
        yield from (group[first:last] for first, last in pairwise(bounds))


def _keys_suffice(track: Track) -> bool:
    return len(track.times) > SUFFICIENT_KEYS or track.interpolation is Interpolation.STEP or len(track.times) == 1


def _samples(tracks: Sequence[Track]) -> _Samples:
    """Keys of tracks of one batch, or with few keys also SAMPLES_PER_INTERVAL more times per interval."""
    stack = TrackStack(tracks)
    keys = stack.keys
    track = np.repeat(np.arange(len(tracks)), keys.counts)
    if _keys_suffice(tracks[0]):
        return _Samples(track, keys.starts, keys.times, stack.values)
    is_last = np.append(track[1:] != track[:-1], True)
    duration = np.where(is_last, 0.0, np.append(np.diff(keys.times), 0.0))
    counts = np.where(is_last, 1, SAMPLES_PER_INTERVAL + 1)
    first: Ints = np.cumsum(counts) - counts
    left = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(left)) - first[left]) / (SAMPLES_PER_INTERVAL + 1)
    times = keys.times[left] + duration[left] * share
    values = stack.interpolate(left, np.where(is_last[left], left, left + 1), times)
    return _Samples(track[left], first[keys.starts], times, values)


def _without_pivots(pivots: Sequence[Pivots], samples: _Samples) -> Floats:
    """R (S, 4) from Rpre · R · Rpost⁻¹."""
    q = samples.rotations
    some = np.array([each is not NO_PIVOTS for each in pivots])[samples.track]
    if not some.any():
        return q
    before = np.array([each.pre_rotation for each in pivots])[samples.track[some]]
    after = np.array([each.post_rotation for each in pivots])[samples.track[some]]
    turns = q.copy()
    turns[some] = quaternion.multiply(quaternion.multiply(quaternion.conjugate(before), q[some]), after)
    return turns


def _nearest(samples: _Samples, turns: Floats, order: str) -> Floats:
    """The least distance (G,) of each track's rotations (S, 4): of those with the largest cosine, but for rounding."""
    cosine = euler.gimbal_cosine(turns, order=order)
    top = np.maximum.reduceat(cosine, samples.starts)
    some = np.flatnonzero(cosine >= top[samples.track] - COSINE_ROUNDING)
    distances = euler.gimbal_distance(turns[some], order=order)
    return np.minimum.reduceat(distances, np.searchsorted(some, samples.starts))


def _own_distances(samples: _Samples, turns: Floats, order: Ints) -> Floats:
    """Distances (S,) of all rotations, by the order (G,) of each track."""
    found = np.empty(len(turns))
    for number in sorted(set(order.tolist())):
        mine = (order == number)[samples.track]
        found[mine] = euler.gimbal_distance(turns[mine], order=ORDERS[number])
    return found


def _rows(nodes: Sequence[EulerNode], samples: _Samples, turns: Floats, nearest: Floats) -> Iterator[GimbalStats]:
    """Yield the statistics of nodes with rotations (S, 4); nearest: (12, G) least distances by order."""
    intrinsic = [n.order if n.frame == AxesConvention.INTRINSIC else n.order[::-1] for n in nodes]
    order = np.array([ORDERS.index(each) for each in intrinsic])
    usual = nearest[order, np.arange(len(nodes))]
    best = np.where(nearest.max(axis=0) <= usual + ANGLE_TOLERANCE_RAD, order, nearest.argmax(axis=0))
    margin = np.degrees(nearest[best, np.arange(len(nodes))])
    own = _own_distances(samples, turns, order)
    close = np.flatnonzero(own <= usual[samples.track] + ANGLE_TOLERANCE_RAD)
    least = close[np.searchsorted(close, samples.starts)]  # the first of each track
    sine = np.minimum(np.cos(own[least]), 1 - 1e-12)
    columns = np.degrees(own[least]), samples.times[least], np.sqrt((1 + sine) / (1 - sine)), margin
    near = _near_times(samples, own)
    for i, (about, better, row) in enumerate(
        zip(nodes, best.tolist(), np.stack(columns, axis=1).tolist(), strict=True)
    ):
        first, last = about.order[0], about.order[2]
        yield GimbalStats(
            about.name,
            about.order,
            str(about.frame),
            row[0],
            row[1],
            near.get(i, 0.0),
            row[2],
            f"{first} and {last}" if first != last else f"both {first}",
            ORDERS[better] if about.frame == AxesConvention.INTRINSIC else ORDERS[better][::-1],
            row[3],
        )


def _near_times(samples: _Samples, distance: Floats) -> dict[int, float]:
    """Seconds within NEAR_LOCK_RAD by index of the track; each sample covers half the interval to its neighbors."""
    near = np.flatnonzero(distance < NEAR_LOCK_RAD)
    if not len(near):
        return {}
    half = np.where(samples.track[1:] == samples.track[:-1], np.diff(samples.times) / 2, 0.0)
    spans = np.zeros(len(samples.times))
    spans[1:] += half
    spans[:-1] += half
    bounds = np.flatnonzero(np.diff(samples.track[near], prepend=-1, append=-1)).tolist()
    return {int(samples.track[near[i]]): float(spans[near[i:j]].sum()) for i, j in pairwise(bounds)}
