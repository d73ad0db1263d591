"""glTF clip → continuous Euler curves of every node, in any order."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

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
from anim.memory import MemoryBudget
from anim.model import Clip, Interpolation, Skeleton, TimeAxis, Track
from anim.sampling import frame_times
from anim.sampling.lazy_batch import batches
from anim.sampling.times import just_before, key_times
from anim.sampling.track import sample

LOCK_TOLERANCE_RAD = 1e-6  # rad; uncertainty of a lock in a file's float32 quaternions
ERROR_FRACTIONS = np.array((0.25, 0.5, 0.75))
MODES = {"STEP": Mode.STEP, "LINEAR": Mode.LINEAR, "CUBICSPLINE": Mode.CUBIC}
MAX_ROUNDS, MAX_KEYS = 24, 500_000
BYTES_PER_VALUE = 160  # of a curve, and of its text as JSON
BLOCK_KEYS = 1 << 14  # keys of nodes converted together


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
    check_curve_memory(clip, 0 if frames is None else len(frames))
    names = labels(skeleton)
    orders.check(names)
    by_node, lost = _by_node(clip, names)
    asked = _Options(orders, frame, frames, tolerance)
    chosen = [_order(skeleton, number, name, by_node.get(number, {}), asked) for number, name in enumerate(names)]
    turns = {number: tracks["rotation"] for number, tracks in by_node.items() if "rotation" in tracks}
    rotations, deviation = _rotations(turns, chosen, asked)
    resting = _rest_angles(skeleton, chosen, frame)
    parents = skeleton.parents.tolist()
    static = set(without) - set(by_node) - set(parents)
    kept = [number for number in range(len(names)) if number not in static]
    places = {-1: -1, **{number: place for place, number in enumerate(kept)}}
    nodes = tuple(
        EulerNode(
            names[number],
            places[parents[number]],
            skeleton.translation[number],
            chosen[number],
            frame,
            resting[number],
            rotations.get(number, (None, None, None)),
            _axes(by_node.get(number, {}).get("translation"), frames),
            skeleton.scale[number],
            _axes(by_node.get(number, {}).get("scale"), frames),
        )
        for number in kept
    )
    return EulerCurves(EulerMotion(nodes, notes=skipped_note(lost)), deviation)


def check_curve_memory(clip: Clip, frames: int) -> None:
    """Raise UnsupportedError if the curves of a clip with so many frames take more than the limit of memory."""
    MemoryBudget(clip.num_bytes).check(BYTES_PER_VALUE * 3 * len(clip.tracks) * frames)


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


def _order(skeleton: Skeleton, number: int, name: str, tracks: dict[str, Track], asked: _Options) -> str:
    if asked.orders.is_one:
        return asked.orders.otherwise
    turn = tracks.get("rotation")
    return asked.orders.of(name, skeleton.rotation[number] if turn is None else _observed_angles(turn), asked.frame)


def _rest_angles(skeleton: Skeleton, orders: Sequence[str], frame: AxesConvention) -> Floats:
    """Angles (N, 3) of the rest pose, each node's in its order."""
    found = np.zeros((len(skeleton), 3))
    order_of = np.array(orders)
    for order in set(orders):
        own = order_of == order
        found[own] = euler.from_quaternion(skeleton.rotation[own], order=order, frame=frame)
    return found


def _rotations(
    turns: Mapping[int, Track], orders: Sequence[str], asked: _Options
) -> tuple[dict[int, tuple[Curve, ...]], float]:
    """Curves of rotations by node, and their greatest error between keys."""
    found: dict[int, tuple[Curve, ...]] = {}
    most = 0.0
    for numbers in _groups(turns, orders, asked):
        tracks = [turns[number] for number in numbers]
        convert = _rotation if len(tracks) == 1 else _rotations_on_one_axis
        curves, deviation = convert(tracks, orders[numbers[0]], asked)
        found.update(zip(numbers, curves, strict=True))
        most = max(most, deviation)
    return found, most


def _groups(turns: Mapping[int, Track], orders: Sequence[str], asked: _Options) -> Iterator[list[int]]:
    """Yield nodes whose rotations are converted at once; single ones where each gets keys of its own."""
    groups: dict[tuple[TimeAxis, Interpolation, str], list[int]] = {}
    for number, track in turns.items():
        groups.setdefault((track.time_axis, track.interpolation, orders[number]), []).append(number)
    for (axis, _, _), numbers in groups.items():
        keys = len(axis) if asked.frames is None else max(len(axis), len(asked.frames))
        size = max(BLOCK_KEYS // keys, 1) if asked.tolerance is None else 1
        yield from (numbers[first : first + size] for first in range(0, len(numbers), size))


def _rotations_on_one_axis(
    tracks: Sequence[Track], order: str, asked: _Options
) -> tuple[list[tuple[Curve, ...]], float]:
    """The curves of each rotation, and their greatest error between keys, as by `_rotation`; all on one time axis."""
    batch = batches(tracks)[0]
    stepped = batch.interpolation is Interpolation.STEP
    times = batch.times if asked.frames is None or stepped else asked.frames
    angles = euler.unwrap(batch.sample(times), order=order, frame=asked.frame, lock=LOCK_TOLERANCE_RAD)
    axis, modes = TimeAxis(times), uniform_modes(len(times), Mode.STEP if stepped else Mode.LINEAR)
    curves = [tuple(Curve(axis, column, modes) for column in node.T) for node in angles.swapaxes(0, 1)]
    if stepped or len(times) == 1:
        return curves, 0.0
    return curves, float(_interval_errors(batch.sample, times, angles, order, asked.frame).max())


def _observed_angles(track: Track) -> Floats:
    """Rotations at the keys and midpoints."""
    halves = (track.times[1:] + track.times[:-1]) / 2
    return sample(track, unique_sorted(np.concatenate((track.times, halves))))


def _rotation(tracks: Sequence[Track], order: str, asked: _Options) -> tuple[list[tuple[Curve, ...]], float]:
    """The three curves of a single rotation, and their error between keys."""
    track = tracks[0]
    stepped, frame, tolerance = track.interpolation is Interpolation.STEP, asked.frame, asked.tolerance
    times = track.times if asked.frames is None or stepped else asked.frames
    for _ in range(MAX_ROUNDS):
        angles = euler.unwrap(sample(track, times), order=order, frame=frame, lock=LOCK_TOLERANCE_RAD)
        if stepped or len(times) == 1:
            mode = Mode.STEP if stepped else Mode.LINEAR
            return [_curves(times, angles, mode)], 0.0
        errors = _interval_errors(partial(sample, track), times, angles, order, frame)
        if tolerance is None or errors.max() <= tolerance:
            break
        starts, _ = split_segments(times[:-1], times[1:], segment_count(errors, tolerance))
        finer = np.append(starts, times[-1])
        if len(finer) == len(times) or len(finer) > MAX_KEYS:
            break
        times = finer
    return [_curves(times, angles, Mode.LINEAR)], float(errors.max())


def _interval_errors(
    sampled: Callable[[Floats], Floats], times: Floats, angles: Floats, order: str, frame: AxesConvention
) -> Floats:
    """Error of linear curves (K, ..., 3) in each interval (K − 1, ...), rad; 0 at a jump without a float32 time inside.

    sampled: gives the rotations (F, ..., 4) at times (F,). Many intervals are measured in blocks.
    """
    found = []
    for first in range(0, len(times) - 1, BLOCK_KEYS):
        some = slice(first, first + BLOCK_KEYS + 1)
        found.append(_block_errors(sampled, times[some], angles[some], order, frame))
    return np.concatenate(found)


def _block_errors(
    sampled: Callable[[Floats], Floats], times: Floats, angles: Floats, order: str, frame: AxesConvention
) -> Floats:
    at = times[:-1] + (times[1:] - times[:-1]) * ERROR_FRACTIONS[:, None]
    u = ERROR_FRACTIONS.reshape(-1, *[1] * angles.ndim)
    straight = angles[:-1] + (angles[1:] - angles[:-1]) * u
    true = sampled(at.ravel()).reshape(*straight.shape[:-1], 4)
    made = euler.to_quaternion(straight, order=order, frame=frame)
    errors: Floats = quaternion.angle_between(made, true).max(axis=0)
    errors[just_before(times[1:]) <= times[:-1]] = 0.0
    return errors


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
