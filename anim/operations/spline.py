"""Smooth curves through keys: tangents by a rule from the table TANGENTS."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TypeVar

import numpy as np

from anim.arguments import check_flags, check_function, index
from anim.curves.tangents.rule import TangentRule
from anim.curves.tangents.table import (
    DEFAULT_RULE,
    LOOP_TOLERANCE_RAD,
    apply_rotation_tangents,
    apply_tangents,
    check_closed,
    parse,
)
from anim.errors import AnimError, RangeError, check_type
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.operations.selection import track_indices
from anim.operations.stacked_tracks import StackedTracks, change_tracks

Keyed = TypeVar("Keyed", Track, StackedTracks)
MIN_VECTOR_RANGE = 1e-3  # lower limit of a vector track's largest value, for the comparison of its ends
END_TOLERANCE_FRACTION = 1e-6  # of the clip's end: differences of float32 times by rounding


def spline(
    clip: Clip,
    *,
    tangents: TangentRule | str = DEFAULT_RULE,
    cyclic: bool = False,
    root: int = -1,
    tracks: frozenset[int] | None = None,
    label: Callable[[int], str] = "node {}".format,
) -> Clip:
    """Return the clip as CUBICSPLINE with tangents by a rule, which replace existing tangents.

    Tangents of rotations come from angular velocities. STEP tracks are intentionally constant between keys and
    unchanged; so are tracks with one key. Values are unchanged except under a rule that approximates (bspline).
    tangents: one of TANGENTS, or its name as text: "natural", "tcb(0, 0, 0.5)".
    cyclic: a loop: the first and the last key are neighbors, so value and speed are continuous at the seam. A track
    that starts late or ends early gets keys at the clip's start and end, with its first and last value.
    root: the node with a translation that continues from cycle to cycle, −1 for none.
    label: gives the name of a node for errors (`Skeleton.label`).
    Raises RangeError if the rule can't be used, and for a loop with a track of different first and last value.
    (keys 0, 1, 2 s: 0, 1, 0; time-aware) → tangents 2, 0, −2
    """
    chosen = track_indices(clip, tracks)
    rule = parse(tangents) if isinstance(tangents, str) else tangents
    check_type(rule, TangentRule, "tangents", help="anim.TANGENTS has their names")
    check_flags(cyclic=cyclic)
    check_function(label, "label", "a function from a node's index to its name")
    root = index(root, "root")
    is_loop = cyclic or rule.loop

    def apply(tracks: StackedTracks) -> Sequence[Track]:
        if not _takes_tangents(tracks):
            return tracks.tracks
        if not (rule.smooth or rule.by_path):
            with suppress(AnimError):  # of one of the tracks, which is named below
                return checked(_apply_rule(_span(tracks, clip) if is_loop else tracks, rule, cyclic=cyclic).split())
        return [alone(track) for track in tracks.tracks]

    def alone(track: Track) -> Track:
        try:
            return checked([_apply_rule(_span(track, clip) if is_loop else track, rule, cyclic=cyclic)])[0]
        except AnimError as error:
            target = track.pointer if track.node is None else f"{label(track.node)}, {track.path}"
            raise error.at(f"track of {target}", ": ") from None

    def checked(found: list[Track]) -> list[Track]:
        for track in found if is_loop else ():
            if track.node != root or track.path != "translation":
                _check_closed(track)
        return found

    return change_tracks(clip, chosen, apply)


def max_key_change(before: Clip, after: Clip) -> tuple[float, float]:
    """Return the largest change of keys: of a vector value, and of a rotation in radians.

    Both clips have the same tracks with the same keys.
    """
    pairs = [
        (old, new)
        for old, new in zip(before.tracks, after.tracks, strict=True)
        if old is not new and old.values.shape == new.values.shape
    ]
    turns = [pair for pair in pairs if pair[0].kind is ValueKind.ROTATION]
    moves = [float(abs(old.values - new.values).max()) for old, new in pairs if old.kind is not ValueKind.ROTATION]
    if not turns:
        return max(moves, default=0.0), 0.0
    a, b = (quaternion.normalize(np.concatenate([track.values for track in side])) for side in zip(*turns, strict=True))
    return max(moves, default=0.0), float(quaternion.angle_between(a, b).max())


def _span(track: Keyed, clip: Clip) -> Keyed:
    """Return tracks with keys at both ends of their clip, within the resolution of float32 times."""
    near = END_TOLERANCE_FRACTION * max(clip.end, 1.0)
    keys = np.arange(len(track.times))
    start, end = int(track.times[0] > clip.start + near), int(track.times[-1] < clip.end - near)
    times = np.concatenate(([clip.start] * start, track.times, [clip.end] * end))
    keys = np.concatenate((keys[:1].repeat(start), keys, keys[-1:].repeat(end)))
    if len(keys) == len(track.times):
        return track
    return track.with_keys(times, track.values[keys], interpolation=Interpolation.LINEAR)  # tangents follow


def _takes_tangents(track: StackedTracks) -> bool:
    is_step = track.interpolation is Interpolation.STEP or track.kind is ValueKind.DISCRETE
    return not is_step and len(track.times) > 1


def _check_closed(track: Track) -> None:
    """Raise RangeError if a track of a loop has different first and last value."""
    if track.kind is ValueKind.ROTATION:
        check_closed(quaternion.normalize(track.values[[0, -1]]))
        return
    gap = float(np.abs(track.values[-1] - track.values[0]).max())
    if gap > LOOP_TOLERANCE_RAD * max(float(np.abs(track.values).max()), MIN_VECTOR_RANGE):
        raise RangeError(f"the loop is open: its last value is {gap:.3g} from its first (expected the same value)")


def _apply_rule(track: Keyed, rule: TangentRule, *, cyclic: bool) -> Keyed:
    make = apply_rotation_tangents if track.kind is ValueKind.ROTATION else apply_tangents
    keys = make(track.times, track.values, rule, cyclic=cyclic)
    spline = Interpolation.CUBICSPLINE
    return track.with_keys(track.time_axis, keys.values, keys.in_tangents, keys.out_tangents, interpolation=spline)
