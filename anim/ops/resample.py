"""The same motion on a regular grid of keys."""

from __future__ import annotations

from anim.arrays import Floats
from anim.errors import RangeError
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Kind, Track
from anim.sampling import slopes
from anim.sampling.times import grid, key_times
from anim.sampling.track import sample

KEEP = "keep"
INTERPOLATIONS = (KEEP, "step", "linear", "cubicspline")


def resample(
    clip: Clip, *, fps: float, interpolation: str = KEEP, snap: bool = False, tracks: frozenset[int] | None = None
) -> Clip:
    """Return the clip with its tracks keyed at `fps` frames per second.

    Keys lie at start + k / fps of the clip; the last key is the clip's end even when the duration is no multiple of
    1 / fps. A track that never changes, or has one key, is kept as it is: more keys would say nothing.
    Rotations stay unit and sign-continuous. Morph weights and pointers are sampled like any other track.

    fps: frames per second, > 0. Raises RangeError otherwise.
    interpolation: "keep", or "step", "linear", "cubicspline" for all tracks; bools and integers stay STEP.
    snap: STEP tracks get their jumps on the grid too; without it their keys stay exactly where they are.
    tracks: numbers of the tracks to resample, None for all.
    (keys 0, 1 s; fps 4) → keys 0, 0.25, 0.5, 0.75, 1 s
    """
    if interpolation not in INTERPOLATIONS:
        raise RangeError(f"interpolation is '{interpolation}' (expected one of {', '.join(INTERPOLATIONS)})")
    times = key_times(grid(clip.start, clip.end, fps=fps))
    chosen = tracks if tracks is not None else frozenset(range(len(clip.tracks)))
    new = (
        _resampled(track, times, interpolation, snap) if i in chosen else track for i, track in enumerate(clip.tracks)
    )
    return Clip(clip.name, tuple(new))


def _resampled(track: Track, times: Floats, interpolation: str, snap: bool) -> Track:
    goal = track.interpolation if interpolation == KEEP else Interpolation(interpolation.upper())
    if track.kind is Kind.DISCRETE:
        goal = Interpolation.STEP
    if len(track.times) == 1 or _is_constant(track):
        return track
    if goal is Interpolation.STEP and track.interpolation is Interpolation.STEP and not snap:
        return track
    values = sample(track, times)
    if track.kind is Kind.ROTATION:
        values = quaternion.align_signs(values)
    tangents: tuple[Floats | None, Floats | None] = (None, None)
    if goal is Interpolation.CUBICSPLINE and len(times) > 1:
        tangents = slopes.tangents(track, times, values)
    elif goal is Interpolation.CUBICSPLINE:
        goal = Interpolation.LINEAR
    return Track(track.node, track.path, goal, times, values, *tangents, pointer=track.pointer, storage=track.storage)


def _is_constant(track: Track) -> bool:
    same = bool((track.values == track.values[0]).all())
    if track.in_tangents is None or track.out_tangents is None:
        return same
    return same and not track.in_tangents[1:].any() and not track.out_tangents[:-1].any()
