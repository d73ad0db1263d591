"""Raw keys as a smooth curve: tangents by a rule from the table TANGENTS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from anim.curves.tangents.rule import TangentRule
from anim.curves.tangents.table import CLOSED, DEFAULT, apply_rotation_tangents, apply_tangents, check_closed, parse
from anim.errors import AnimError, RangeError
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track, ValueKind

SMALLEST = 1e-3  # ends of a vector's track are compared with its largest value, and with this at least
NEAR = 1e-6  # of the clip's end: times in float32 that mean the same


def spline(
    clip: Clip,
    *,
    tangents: TangentRule | str = DEFAULT,
    cyclic: bool = False,
    root: int = -1,
    tracks: frozenset[int] | None = None,
    label: Callable[[int], str] = "node {}".format,
) -> Clip:
    """Return the clip with its keys joined by cubics whose tangents follow a rule; tangents that were there go.

    Rotations get theirs from angular velocities, so that they are those of a turning thing. STEP tracks hold on purpose
    and stay; so do tracks with one key. Values stay too, but under a rule that approximates (bspline).
    tangents: one of TANGENTS, or a text that names it: "natural", "tcb(0, 0, 0.5)".
    cyclic: a loop: the first and the last key are neighbors, so value and speed have no seam. A track that starts late
    or ends early stands still at the seam: its keys are not neighbors.
    root: the node whose translation goes on from lap to lap, −1 for none.
    label: gives what errors call a node (`Skeleton.label`).
    Raises RangeError where the rule can't be used, and for a loop with a track that ends in another value than it
    starts with.
    (keys 0, 1, 2 s: 0, 1, 0; time-aware) → tangents 2, 0, −2
    """
    rule = parse(tangents) if isinstance(tangents, str) else tangents
    chosen = tracks if tracks is not None else frozenset(range(len(clip.tracks)))
    new = list(clip.tracks)
    for i in sorted(chosen):
        track = new[i]
        try:
            new[i] = _splined(track, rule, cyclic=cyclic and _spans(track, clip))
            travels = track.node == root and track.path == "translation"
            if (cyclic or rule.loop) and new[i] is not track and not travels:
                _check_closed(track)
        except AnimError as error:
            target = track.pointer if track.node is None else f"{label(track.node)}, {track.path}"
            raise error.at(f"track of {target}", ": ") from None
    return Clip(clip.name, tuple(new))


def max_key_change(before: Clip, after: Clip) -> tuple[float, float]:
    """Return how far keys were moved at most: largest change of a vector value, and largest turn in radians.

    Both clips have the same tracks with the same keys.
    """
    moved, turned = 0.0, 0.0
    for old, new in zip(before.tracks, after.tracks, strict=True):
        if old is new or old.values.shape != new.values.shape:
            continue
        if old.kind is ValueKind.ROTATION:
            a, b = quaternion.normalize(old.values), quaternion.normalize(new.values)
            turned = max(turned, float(quaternion.angle_between(a, b).max()))
        else:
            moved = max(moved, float(abs(old.values - new.values).max()))
    return moved, turned


def _spans(track: Track, clip: Clip) -> bool:
    """Whether a track has keys at both ends of its clip, as near as float32 times can tell."""
    near = NEAR * max(clip.end, 1.0)
    return bool(track.times[0] <= clip.start + near and track.times[-1] >= clip.end - near)


def _check_closed(track: Track) -> None:
    """Raise RangeError where a track of a loop ends in another value than it starts with."""
    if track.kind is ValueKind.ROTATION:
        check_closed(quaternion.normalize(track.values[[0, -1]]))
        return
    gap = float(np.abs(track.values[-1] - track.values[0]).max())
    if gap > CLOSED * max(float(np.abs(track.values).max()), SMALLEST):
        raise RangeError(f"the loop is open: its last value is {gap:.3g} from its first (expected the same value)")


def _splined(track: Track, rule: TangentRule, *, cyclic: bool) -> Track:
    if track.interpolation is Interpolation.STEP or track.kind is ValueKind.DISCRETE or len(track.times) == 1:
        return track
    make = apply_rotation_tangents if track.kind is ValueKind.ROTATION else apply_tangents
    keys = make(track.times, track.values, rule, cyclic=cyclic)
    return replace(
        track,
        interpolation=Interpolation.CUBICSPLINE,
        values=keys.values,
        in_tangents=keys.in_tangents,
        out_tangents=keys.out_tangents,
    )
