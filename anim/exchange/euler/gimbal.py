"""Distance from gimbal lock for each joint, and the order with the greatest distance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, Pivots
from anim.maths import euler, quaternion
from anim.maths.euler import ORDERS, AxesConvention
from anim.model import Clip, Interpolation, TimeAxis, Track
from anim.sampling.track import sample

NEAR_LOCK_RAD = np.radians(5.0)  # from lock: rates are amplified 23 times there
SUFFICIENT_KEYS, SAMPLES_PER_INTERVAL = 500, 29  # sufficient keys; samples per interval with fewer keys
ANGLE_TOLERANCE_RAD = 1e-9  # rad; smaller differences are ignored: the first counts
MAX_BATCH_QUATERNIONS = 200_000  # quaternions evaluated together


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
    rows = []
    for times, nodes, values in _stack_angles(motion, clip):
        by_order = {order: euler.gimbal_distance(values, order=order) for order in ORDERS}
        nearest = {order: distance.min(axis=0) for order, distance in by_order.items()}
        for i, node in enumerate(nodes):
            about = motion.nodes[node]
            order = about.order if about.frame == AxesConvention.INTRINSIC else about.order[::-1]
            best = max(ORDERS, key=lambda each: float(nearest[each][i]))
            if nearest[best][i] <= nearest[order][i] + 1e-9:
                best = order
            own = by_order[order][:, i]
            rows.append((node, _row(motion, node, times, own, best, float(nearest[best][i]))))
    return tuple(row for _, row in sorted(rows, key=lambda each: each[0]))


def _stack_angles(motion: EulerMotion, clip: Clip) -> Iterator[tuple[Floats, list[int], Floats]]:
    """Yield tracks of one time axis: times (K,), nodes, rotations (K, G, 4), sized for CPU caches."""
    groups: dict[tuple[TimeAxis, bool], list[tuple[int, Track]]] = {}
    for track in clip.tracks:
        if track.path == "rotation" and track.node is not None and motion.nodes[track.node].order in ORDERS:
            groups.setdefault((track.time_axis, _keys_suffice(track)), []).append((track.node, track))
    for (axis, at_keys), group in groups.items():
        times = axis.times if at_keys else _check_times(axis.times)
        count = max(MAX_BATCH_QUATERNIONS // len(times), 1)
        for start in range(0, len(group), count):
            part = group[start : start + count]
            turns = [
                _without_pivots(motion.nodes[node].pivots, track.values if at_keys else sample(track, times))
                for node, track in part
            ]
            yield times, [node for node, _ in part], np.stack(turns, axis=1)


def _keys_suffice(track: Track) -> bool:
    return len(track.times) > SUFFICIENT_KEYS or track.interpolation is Interpolation.STEP or len(track.times) == 1


def _check_times(keys: Floats) -> Floats:
    """Keys with SAMPLES_PER_INTERVAL more times per interval."""
    shares = np.arange(SAMPLES_PER_INTERVAL + 1) / (SAMPLES_PER_INTERVAL + 1)
    return np.append((keys[:-1, None] + np.diff(keys)[:, None] * shares).ravel(), keys[-1])


def _without_pivots(pivots: Pivots, q: Floats) -> Floats:
    """R (K, 4) from Rpre · R · Rpost⁻¹."""
    if pivots is NO_PIVOTS:
        return q
    return quaternion.multiply(quaternion.multiply(quaternion.conjugate(pivots.pre_rotation), q), pivots.post_rotation)


def _row(
    motion: EulerMotion, node: int, times: Floats, distance: Floats, best: str, best_nearest: float
) -> GimbalStats:
    about = motion.nodes[node]
    least = int((distance <= distance.min() + ANGLE_TOLERANCE_RAD).argmax())
    spans = np.zeros(len(times))  # each key covers half the interval to its neighbors
    spans[1:] += np.diff(times) / 2
    spans[:-1] += np.diff(times) / 2
    sine = min(float(np.cos(distance[least])), 1 - 1e-12)
    return GimbalStats(
        about.name,
        about.order,
        str(about.frame),
        float(np.degrees(distance[least])),
        float(times[least]),
        float(spans[distance < NEAR_LOCK_RAD].sum()),
        float(np.sqrt((1 + sine) / (1 - sine))),
        f"{about.order[0]} and {about.order[2]}" if about.order[0] != about.order[2] else f"both {about.order[0]}",
        best if about.frame == AxesConvention.INTRINSIC else best[::-1],
        float(np.degrees(best_nearest)),
    )
