"""A glTF clip → Euler curves of every node, in any order, that run on without jumps."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats, sorted_unique
from anim.errors import RangeError
from anim.exchange.curve import Curve, Mode, uniform_modes
from anim.exchange.motion import EulerMotion, EulerNode
from anim.exchange.orders import Orders
from anim.maths import euler, quaternion
from anim.maths.euler import Frame
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.sampling import grid
from anim.sampling.times import key_times
from anim.sampling.track import sample

FILE_LOCK = 1e-6  # rad; what a file's float32 quaternions leave of a lock
LISTED = 3  # of what is left out
BETWEEN = np.array((0.25, 0.5, 0.75))
MODES = {"STEP": Mode.STEP, "LINEAR": Mode.LINEAR, "CUBICSPLINE": Mode.CUBIC}
ROUNDS, MOST_PIECES, MAX_KEYS = 24, 32, 500_000


@dataclass(frozen=True, slots=True)
class EulerCurves:
    """Curves of all nodes, in local space; what has no place in them is in the notes.

    deviation: rad, the most that straight curves leave the motion between keys.
    """

    motion: EulerMotion
    deviation: float


def to_euler(
    skeleton: Skeleton,
    clip: Clip,
    *,
    order: str | Orders,
    frame: Frame = Frame.INTRINSIC,
    fps: float | None = None,
    tolerance: float | None = None,
    without: Collection[int] = (),
) -> EulerCurves:
    """Return the clip as Euler curves in radians, straight between keys, and the rest of all nodes.

    Each key gets the equivalent triple nearest to the key before; at lock see `euler.continuous`. Keys stand where the
    tracks have theirs, or at `fps` frames per second; steps stay steps. Translations and scales keep their cubics.
    order: one of the twelve for all nodes, or `Orders`; auto looks at the clip's keys and half way between.
    tolerance: rad; keys are added where straight curves would leave the motion by more. Raises RangeError below 1e-6.
    without: nodes to leave out where nothing moves them and nothing hangs on them, such as those that hold a skin.
    """
    orders = order if isinstance(order, Orders) else Orders(euler.check_order(order))
    if tolerance is not None and not 1e-6 <= tolerance < np.inf:
        raise RangeError(f"tolerance is {tolerance:g} rad (expected 1e-06 or more)")
    frames = key_times(grid(clip.start, clip.end, fps=fps)) if fps is not None else None
    names = unique_names(skeleton)
    orders.check(names)
    by_node, lost = _by_node(clip, names)
    nodes, deviation = [], 0.0
    for number, name in enumerate(names):
        tracks = by_node.get(number, {})
        turn = tracks.get("rotation")
        rotation: tuple[Curve | None, ...] = (None, None, None)
        own = orders.of(name, skeleton.rotation[number] if turn is None else _seen(turn), frame)
        if turn is not None:
            rotation, off = _rotation(turn, own, frame, frames, tolerance)
            deviation = max(deviation, off)
        rest = euler.from_quaternion(skeleton.rotation[number], order=own, frame=frame)
        nodes.append(
            EulerNode(
                name,
                int(skeleton.parents[number]),
                skeleton.translation[number],
                own,
                frame,
                rest,
                rotation,
                _axes(tracks.get("translation"), frames),
                skeleton.scale[number],
                _axes(tracks.get("scale"), frames),
            )
        )
    kept = [n for n in range(len(nodes)) if n not in without or n in by_node or (skeleton.parents == n).any()]
    return EulerCurves(EulerMotion(_renumbered(nodes, kept), notes=(left_out(lost),) if lost else ()), deviation)


def unique_names(skeleton: Skeleton) -> list[str]:
    """Return a name for every node, no two alike: "hip", "hip.2", "node 7" where it has none."""
    taken: set[str] = set()
    names = []
    for number, given in enumerate(skeleton.names):
        name = base = " ".join(given.split()) or f"node {number}"
        count = 1
        while name in taken:
            count += 1
            name = f"{base}.{count}"
        taken.add(name)
        names.append(name)
    return names


def left_out(what: Sequence[str]) -> str:
    """Return "left out: weights of 'head', scale of 'arm' and 3 more"."""
    more = f" and {len(what) - LISTED} more" if len(what) > LISTED else ""
    return f"left out: {', '.join(what[:LISTED])}{more}"


def what_of(track: Track, names: Sequence[str]) -> str:
    """Return what a track moves, in words: "weights of 'head'"."""
    return f"{track.path} of '{names[track.node]}'" if track.node is not None else f"{track.pointer}"


def _by_node(clip: Clip, names: list[str]) -> tuple[dict[int, dict[str, Track]], list[str]]:
    """Tracks by node and path, and words for those that have no place in Euler curves."""
    by_node: dict[int, dict[str, Track]] = {}
    lost = []
    for track in clip.tracks:
        if track.node is None or track.path not in ("translation", "rotation", "scale"):
            lost.append(what_of(track, names))
        else:
            by_node.setdefault(track.node, {})[track.path] = track
    return by_node, lost


def _renumbered(nodes: list[EulerNode], kept: list[int]) -> tuple[EulerNode, ...]:
    places = {-1: -1, **{node: place for place, node in enumerate(kept)}}
    return tuple(replace(nodes[node], parent=places[nodes[node].parent]) for node in kept)


def _seen(track: Track) -> Floats:
    """Rotations at the keys and half way between."""
    halves = (track.times[1:] + track.times[:-1]) / 2
    return sample(track, sorted_unique(np.concatenate((track.times, halves))))


def _rotation(
    track: Track, order: str, frame: Frame, frames: Floats | None, tolerance: float | None
) -> tuple[tuple[Curve, ...], float]:
    """The three curves of a rotation, and how far they leave it between keys."""
    stepped = track.interpolation is Interpolation.STEP
    times = track.times if frames is None else frames
    for _ in range(ROUNDS):
        angles = euler.continuous(sample(track, times), order=order, frame=frame, lock=FILE_LOCK)
        if stepped or len(times) == 1:
            mode = Mode.STEP if stepped else Mode.LINEAR
            return _curves(times, angles, mode), 0.0
        errors = _between(track, times, angles, order, frame)
        if tolerance is None or errors.max() <= tolerance:
            break
        finer = _refined(times, errors, tolerance)
        if len(finer) == len(times) or len(finer) > MAX_KEYS:
            break
        times = finer
    return _curves(times, angles, Mode.LINEAR), float(errors.max())


def _between(track: Track, times: Floats, angles: Floats, order: str, frame: Frame) -> Floats:
    """How far straight curves leave the motion in each piece (K − 1,), rad; 0 in a jump, where no float32 time lies."""
    u = BETWEEN[:, None]
    at = times[:-1] + (times[1:] - times[:-1]) * u
    straight = angles[:-1] + (angles[1:] - angles[:-1]) * u[..., None]
    true = sample(track, at.ravel()).reshape(*at.shape, 4)
    made = euler.to_quaternion(straight, order=order, frame=frame)
    jumps = np.nextafter(times[:-1].astype(np.float32), np.float32(np.inf)) >= times[1:]
    return np.where(jumps, 0.0, quaternion.angle_between(made, true).max(axis=0))


def _refined(times: Floats, errors: Floats, tolerance: float) -> Floats:
    pieces = np.clip(np.ceil(np.sqrt(errors / tolerance)), 1, MOST_PIECES).astype(np.int64)
    new = [
        times[k] + (times[k + 1] - times[k]) * np.arange(1, pieces[k]) / pieces[k] for k in np.flatnonzero(pieces > 1)
    ]
    return key_times(np.concatenate([times, *new]))


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
    return {axis: Curve(track.times, *((part[0], modes, part[1], part[2]))) for axis, part in enumerate(parts)}


def _curves(times: Floats, values: Floats, mode: Mode) -> tuple[Curve, ...]:
    modes = uniform_modes(len(times), mode)
    return tuple(Curve(times, column, modes) for column in values.T)
