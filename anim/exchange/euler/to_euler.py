"""glTF clip → continuous Euler curves of every node, in any order."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats, unique_sorted
from anim.curves.fitting.adaptive_keys import segment_count, split_segments
from anim.errors import RangeError
from anim.exchange.euler.curve import Curve, Mode, uniform_modes
from anim.exchange.euler.motion import EulerMotion, EulerNode
from anim.exchange.euler.rotation_order import OrderRules
from anim.exchange.formats.labels import label_of, labels, skipped_note
from anim.maths import euler, quaternion
from anim.maths.euler import AxesConvention
from anim.model import Clip, Interpolation, Skeleton, TimeAxis, Track
from anim.sampling import frame_times
from anim.sampling.times import just_before, key_times
from anim.sampling.track import sample

LOCK_TOLERANCE_RAD = 1e-6  # rad; uncertainty of a lock in a file's float32 quaternions
ERROR_FRACTIONS = np.array((0.25, 0.5, 0.75))
MODES = {"STEP": Mode.STEP, "LINEAR": Mode.LINEAR, "CUBICSPLINE": Mode.CUBIC}
MAX_ROUNDS, MAX_KEYS = 24, 500_000


@dataclass(frozen=True, slots=True)
class EulerCurves:
    """Curves of all nodes, in local space; the notes list unsupported tracks.

    deviation: rad, the maximum error of linear curves between keys.
    """

    motion: EulerMotion
    deviation: float


def to_euler(
    skeleton: Skeleton,
    clip: Clip,
    *,
    order: str | OrderRules,
    frame: AxesConvention = AxesConvention.INTRINSIC,
    fps: float | None = None,
    tolerance: float | None = None,
    without: Collection[int] = (),
) -> EulerCurves:
    """Return the clip as Euler curves in radians, linear between keys, and the rest pose of all nodes.

    Each key gets the equivalent triple nearest to the previous key; at lock see `euler.continuous`. Keys are at the
    tracks' key times, or at `fps` frames per second; steps remain steps, at their times. Translations and scales keep
    their cubics without `fps`.
    order: one of the twelve for all nodes, or `OrderRules`; auto evaluates the clip's keys and the midpoints.
    tolerance: rad; keys are added where linear curves would exceed it. Raises RangeError below 1e-6.
    without: nodes to omit if they are static and have no children, such as those with a skinned mesh.
    """
    orders = order if isinstance(order, OrderRules) else OrderRules(euler.check_order(order))
    if tolerance is not None and not 1e-6 <= tolerance < np.inf:
        raise RangeError(f"`tolerance` is {tolerance:g} rad (expected 1e-06 or more)")
    frames = key_times(frame_times(clip.start, clip.end, fps=fps)) if fps is not None else None
    names = labels(skeleton)
    orders.check(names)
    by_node, lost = _by_node(clip, names)
    asked = _Options(orders, frame, frames, tolerance)
    found = [_node(skeleton, number, name, by_node.get(number, {}), asked) for number, name in enumerate(names)]
    nodes, deviation = [node for node, _ in found], max((off for _, off in found), default=0.0)
    kept = [n for n in range(len(nodes)) if n not in without or n in by_node or (skeleton.parents == n).any()]
    return EulerCurves(EulerMotion(_renumber_nodes(nodes, kept), notes=skipped_note(lost)), deviation)


@dataclass(frozen=True, slots=True)
class _Options:
    """Curve options. frames: (F,) s, key times; None for the tracks' own. tolerance: rad."""

    orders: OrderRules
    frame: AxesConvention
    frames: Floats | None
    tolerance: float | None


def _by_node(clip: Clip, names: list[str]) -> tuple[dict[int, dict[str, Track]], list[str]]:
    """Tracks by node and path, and descriptions of those that Euler curves cannot represent."""
    by_node: dict[int, dict[str, Track]] = {}
    lost = []
    for track in clip.tracks:
        if track.node is None or track.path not in ("translation", "rotation", "scale"):
            lost.append(label_of(track, names))
        else:
            by_node.setdefault(track.node, {})[track.path] = track
    return by_node, lost


def _node(
    skeleton: Skeleton, number: int, name: str, tracks: dict[str, Track], asked: _Options
) -> tuple[EulerNode, float]:
    """A node with curves of its tracks by path, and the error of its rotation between keys, rad."""
    turn, still, frame = tracks.get("rotation"), skeleton.rotation[number], asked.frame
    order = asked.orders.of(name, still if turn is None else _observed_angles(turn), frame)
    rotation: tuple[Curve | None, ...] = (None, None, None)
    deviation = 0.0
    if turn is not None:
        rotation, deviation = _rotation(turn, order, asked)
    node = EulerNode(
        name,
        int(skeleton.parents[number]),
        skeleton.translation[number],
        order,
        frame,
        euler.from_quaternion(still, order=order, frame=frame),
        rotation,
        _axes(tracks.get("translation"), asked.frames),
        skeleton.scale[number],
        _axes(tracks.get("scale"), asked.frames),
    )
    return node, deviation


def _renumber_nodes(nodes: list[EulerNode], kept: list[int]) -> tuple[EulerNode, ...]:
    places = {-1: -1, **{node: place for place, node in enumerate(kept)}}
    return tuple(replace(nodes[node], parent=places[nodes[node].parent]) for node in kept)


def _observed_angles(track: Track) -> Floats:
    """Rotations at the keys and midpoints."""
    halves = (track.times[1:] + track.times[:-1]) / 2
    return sample(track, unique_sorted(np.concatenate((track.times, halves))))


def _rotation(track: Track, order: str, asked: _Options) -> tuple[tuple[Curve, ...], float]:
    """The three curves of a rotation, and their error between keys."""
    stepped, frame, tolerance = track.interpolation is Interpolation.STEP, asked.frame, asked.tolerance
    times = track.times if asked.frames is None or stepped else asked.frames
    for _ in range(MAX_ROUNDS):
        angles = euler.unwrap(sample(track, times), order=order, frame=frame, lock=LOCK_TOLERANCE_RAD)
        if stepped or len(times) == 1:
            mode = Mode.STEP if stepped else Mode.LINEAR
            return _curves(times, angles, mode), 0.0
        errors = _interval_errors(track, times, angles, order, frame)
        if tolerance is None or errors.max() <= tolerance:
            break
        starts, _ = split_segments(times[:-1], times[1:], segment_count(errors, tolerance))
        finer = np.append(starts, times[-1])
        if len(finer) == len(times) or len(finer) > MAX_KEYS:
            break
        times = finer
    return _curves(times, angles, Mode.LINEAR), float(errors.max())


def _interval_errors(track: Track, times: Floats, angles: Floats, order: str, frame: AxesConvention) -> Floats:
    """Error of linear curves in each interval (K − 1,), rad; 0 at a jump without a float32 time inside."""
    u = ERROR_FRACTIONS[:, None]
    at = times[:-1] + (times[1:] - times[:-1]) * u
    straight = angles[:-1] + (angles[1:] - angles[:-1]) * u[..., None]
    true = sample(track, at.ravel()).reshape(*at.shape, 4)
    made = euler.to_quaternion(straight, order=order, frame=frame)
    jumps = just_before(times[1:]) <= times[:-1]
    return np.where(jumps, 0.0, quaternion.angle_between(made, true).max(axis=0))


def _axes(track: Track | None, frames: Floats | None) -> dict[int, Curve]:
    if track is None:
        return {}
    if frames is not None and track.interpolation is not Interpolation.STEP:
        return dict(enumerate(_curves(frames, sample(track, frames), Mode.LINEAR)))
    mode = MODES[track.interpolation]
    if mode is not Mode.CUBIC or track.in_tangents is None or track.out_tangents is None:
        return dict(enumerate(_curves(track.times, track.values, mode)))
    modes = uniform_modes(len(track.times), mode)
    parts = zip(track.values.T, track.in_tangents.T, track.out_tangents.T, strict=True)
    return {axis: Curve(track.time_axis, part[0], modes, part[1], part[2]) for axis, part in enumerate(parts)}


def _curves(times: Floats, values: Floats, mode: Mode) -> tuple[Curve, ...]:
    axis, modes = TimeAxis(times), uniform_modes(len(times), mode)
    return tuple(Curve(axis, column, modes) for column in values.T)
