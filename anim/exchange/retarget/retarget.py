"""Retarget a motion to another skeleton: world-space rotations relative to both rest poses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

import numpy as np

from anim.arrays import Floats, Ints, unique_sorted
from anim.curves.fitting.adaptive_keys import (
    refine,
    rotation_segment_count,
    sample_times,
    vector_segment_count,
)
from anim.errors import NotFoundError, UnsupportedError
from anim.exchange.euler.from_euler import ImportedMotion
from anim.exchange.retarget.ground_contact import find_soles, ground_offset, has_feet, with_descendants
from anim.exchange.retarget.joint_matching import JointMatch
from anim.exchange.retarget.pose_transfer import PoseTransfer, TargetMotion, build_transfer
from anim.exchange.retarget.rest_alignment import Measure
from anim.exchange.retarget.step_keys import as_linear, as_step, inside_interval, is_step
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Scene, Track
from anim.sampling import rest_world
from anim.sampling.times import just_before

MAX_CONTACT_DURATION_S = 86_400.0  # limit of a motion sampled for contacts, 30 times a second and more
CONSTANT_TOLERANCE = 1e-7  # rad, factor, and fraction of the target's size: rounding of a constant
CONTACT_STEP_S = 1 / 30  # s, maximum step between times at which soles are sampled
NUM_SAMPLES = 7  # inside a segment, of the error of keys
BLOCK_MATRICES = 200_000  # of all nodes and samples of segments that are counted together: 60 MB


class GroundMode(StrEnum):
    """Treatment of the hips' height."""

    CONTACT = "contact"
    KEEP = "keep"


@dataclass(frozen=True, slots=True)
class Retargeted:
    """The clip for the target, the size ratio target / source, and results of the ground contact.

    lowered: minimum and maximum lowering of the hips, in metres. measure: source of the scale.
    """

    clip: Clip
    scale: float
    lowered: tuple[float, float]
    measure: Measure


@dataclass(frozen=True, slots=True)
class _RequiredKeys:
    """The target's motion at times (K,), and the choice of keys.

    before: the times that precede steps. inside: the motion at `inside_interval(knots)`; None without steps.
    thin: True to omit keys where nothing changes; recordings keep their grid.
    """

    times: Floats
    motion: TargetMotion
    before: Floats
    knots: Floats
    inside: TargetMotion | None
    thin: bool

    def track(self, node: int, path: str, tolerance: float) -> Track:
        """Return a STEP track if the value is constant between all knots of the source, else LINEAR."""
        values = _of(self.motion, node, path)
        if self.inside is not None and is_step(_of(self.inside, node, path), tolerance=tolerance):
            at = np.isin(self.times, self.knots)
            return as_step(node, path, self.times[at], values[at])
        return as_linear(node, path, self.times, values, before=self.before, thin=self.thin)


def _of(found: TargetMotion, node: int, path: str) -> Floats:
    if path == "rotation":
        return quaternion.align_signs(found.rotations[node])
    return found.translations[node] if path == "translation" else found.scales[node]


def retarget(
    source: ImportedMotion,
    target: Scene,
    matching: JointMatch,
    *,
    floor: GroundMode = GroundMode.CONTACT,
    bind_time: float | None = None,
) -> Retargeted:
    """Return a clip that moves the target's matched joints like the source's; see `build_transfer`.

    Keys are at all times of the source, and between them where interpolation would exceed the source's tolerance, times
    the target's size for its path; recordings keep their grid.
    floor: CONTACT moves the hips vertically so that the soles keep their rest height while a foot of the source is
    down; KEEP only scales heights, and so does CONTACT without a matched foot.
    bind_time: s, time of the source's rest pose; None for the pose with all angles zero.
    Raises NotFoundError without a matched joint, UnsupportedError for CONTACT in a motion of over a day.
    """
    if not matching.pairs:
        raise NotFoundError("no joint of the motion is one of the character", help="pair them in an `alias` file")
    if floor == GroundMode.CONTACT and source.clip.end - source.clip.start > MAX_CONTACT_DURATION_S:
        seconds = source.clip.end - source.clip.start
        problem = f"the motion lasts {seconds:g} s: too long to find foot contacts"
        raise UnsupportedError(problem, help="choose `floor` keep")
    follow = build_transfer(source.skeleton, source.clip, target.skeleton, matching, bind_time=bind_time)
    size = float(np.ptp(follow.target_rest.positions, axis=0).max()) or 1.0
    knots, before = _times(source.clip)
    times = unique_sorted(np.concatenate((knots, before)))
    looked_at, lowered = times, np.zeros(len(times))
    if floor == GroundMode.CONTACT and not follow.aligned.alike and has_feet(matching.target_roles):
        looked_at = times if source.tolerance is None else _limit_step(times, CONTACT_STEP_S)
        lowered = _height_above_floor(follow, target, matching, looked_at)

    def at(when: Floats) -> TargetMotion:
        return follow.at(when, np.interp(when, looked_at, lowered))

    if source.tolerance is not None:
        units = _metres_per_unit(follow)
        count = partial(_segment_count, at, units=units, size=size, tolerance=source.tolerance)
        num_nodes = len(source.skeleton) + len(target.skeleton)
        block = max(BLOCK_MATRICES // (NUM_SAMPLES * num_nodes), 1)
        times = refine(times, count, block=block)
    inside = at(inside_interval(knots)) if len(before) else None
    wanted = _RequiredKeys(times, at(times), before, knots, inside, thin=source.tolerance is not None)
    clip = Clip(source.clip.name, tuple(_tracks(follow, wanted, size)))
    return Retargeted(clip, follow.aligned.scale, (float(lowered.min()), float(lowered.max())), follow.aligned.measure)


def _times(clip: Clip) -> tuple[Floats, Floats]:
    """All key times (T,), and the float32 times before those with a possible step."""
    axes = dict.fromkeys(track.time_axis for track in clip.tracks if track.interpolation is Interpolation.STEP)
    return clip.key_times, np.concatenate([np.zeros(0), *(just_before(axis.times[1:]) for axis in axes)])


def _limit_step(times: Floats, step: float) -> Floats:
    """Times with added ones between them so that no interval exceeds `step`."""
    grid = np.arange(times[0], times[-1], step)
    return unique_sorted(np.concatenate((times, grid)))


def _height_above_floor(follow: PoseTransfer, target: Scene, matching: JointMatch, times: Floats) -> Floats:
    """Height (F,) of the target above the floor with heights scaled only, in metres."""
    found = follow.at(times)
    feet = find_soles(target, follow.target_rest.positions, [*matching.target_roles.items()])
    roles = matching.source_roles
    of_source = [with_descendants(follow.source, {roles[f]}) for f in ("left_foot", "right_foot") if f in roles]
    heights, world = found.source[:, :, 1, 3].T, found.world.transpose(1, 0, 2, 3)
    return ground_offset(times, heights, of_source, feet.heights(world), feet.floor, follow.aligned.scale)


def _metres_per_unit(follow: PoseTransfer) -> dict[int, float]:
    """Metres per unit of the parent space of each matched target node, at rest."""
    skeleton = follow.target
    world = rest_world(skeleton)
    lengths = {-1: 1.0} | {n: float(np.cbrt(abs(np.linalg.det(world[n, :, :3])))) for n in range(len(skeleton))}
    return {node: lengths[int(skeleton.parents[node])] for node in follow.pairs.values()}


def _segment_count(
    motion: Callable[[Floats], TargetMotion],
    a: Floats,
    b: Floats,
    *,
    units: Mapping[int, float],
    size: float,
    tolerance: float,
) -> Ints:
    """The number (B,) of segments from a to b (B,): paths, and scales × size, within tolerance × size.

    units: metres per unit of each node's parent space.
    """
    times = sample_times(a, b, NUM_SAMPLES)
    found = motion(times.ravel())
    paths = [found.translations[node] * unit for node, unit in units.items()]
    paths += [scale * size for scale in found.scales.values()]
    rotations = np.stack([*found.rotations.values()], axis=1).reshape(*times.shape, -1, 4)
    vectors = np.stack(paths, axis=1).reshape(*times.shape, -1, 3)
    return np.maximum(rotation_segment_count(rotations, tolerance), vector_segment_count(vectors, tolerance * size))


def _tracks(follow: PoseTransfer, wanted: _RequiredKeys, size: float) -> list[Track]:
    """Tracks of the matched nodes; none for constant rest values without a track in the source."""
    moved = {(track.node, track.path) for track in follow.clip.tracks}
    lengths, still, found = _metres_per_unit(follow), follow.target, wanted.motion
    tracks = []
    for a, b in sorted(follow.pairs.items(), key=lambda pair: pair[1]):
        rotation = quaternion.align_signs(found.rotations[b])
        if (a, "rotation") in moved or quaternion.angle_between(rotation, still.rotation[b]).max() > CONSTANT_TOLERANCE:
            tracks.append(wanted.track(b, "rotation", CONSTANT_TOLERANCE))
        far = np.abs(found.translations[b] - still.translation[b]).max() * lengths[b]
        if (b == follow.top and (a, "translation") in moved) or far > CONSTANT_TOLERANCE * size:
            tracks.append(wanted.track(b, "translation", CONSTANT_TOLERANCE * size / lengths[b]))
        if np.abs(found.scales[b] - still.scale[b]).max() > CONSTANT_TOLERANCE:
            tracks.append(wanted.track(b, "scale", CONSTANT_TOLERANCE))
    return tracks or [wanted.track(follow.top, "translation", CONSTANT_TOLERANCE)]
