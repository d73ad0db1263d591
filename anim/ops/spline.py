"""Raw keys as a smooth curve: tangents by a rule from the table TANGENTS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from anim.curves.tangents.rule import TangentRule
from anim.curves.tangents.table import apply_rotation_tangents, apply_tangents
from anim.errors import AnimError
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track, ValueKind


def spline(
    clip: Clip,
    *,
    tangents: TangentRule,
    cyclic: bool = False,
    tracks: frozenset[int] | None = None,
    label: Callable[[int], str] = "node {}".format,
) -> Clip:
    """Return the clip with its keys joined by cubics whose tangents follow a rule; tangents that were there go.

    Rotations get theirs from angular velocities, so that they are those of a turning thing. STEP tracks hold on purpose
    and stay; so do tracks with one key. Values stay too, but under a rule that approximates (bspline).
    cyclic: a loop: the first and the last key are neighbors, so value and speed have no seam.
    label: gives what errors call a node (`Skeleton.label`).
    Raises RangeError where the rule can't be used.
    (keys 0, 1, 2 s: 0, 1, 0; time-aware) → tangents 2, 0, −2
    """
    chosen = tracks if tracks is not None else frozenset(range(len(clip.tracks)))
    new = list(clip.tracks)
    for i in sorted(chosen):
        track = new[i]
        try:
            new[i] = _splined(track, tangents, cyclic=cyclic)
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
