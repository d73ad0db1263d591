"""Clip → clip with the motion of spring bones: timing, warm-up, and loops."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats, freeze
from anim.errors import RangeError, check_number
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Skeleton, TimeAxis, Track
from anim.sampling.times import distinct_float32, frame_times
from anim.simulation.integrators import find_integrator
from anim.simulation.spring_bones.chain_globs import drop_inert_joints
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.hierarchy import check_hierarchy, scale_bones, scaled_colliders, uneven_joints
from anim.simulation.spring_bones.loop import LoopedMotion, run_loop
from anim.simulation.spring_bones.solver import SpringMotion, SpringSolver
from anim.simulation.steps import Steps
from anim.units import plural

DEFAULT_STEP_S = 1 / 60  # the rate of players: drag is per step, so another step is another motion
MIN_LOOP_STEPS = 2
STEP_BYTES, FRAME_BYTES = 80, 180  # of a joint at each step and frame, while they become keys
STEP_TOLERANCE = 1e-9  # of a step: rounding of n · step


@dataclass(frozen=True, slots=True)
class SpringOptions:
    """Timing of a simulation, in seconds.

    duration: None for the length of the clip. step: of the simulation. warm_up: simulated before 0 s at the pose of
    0 s. loop: close the loop of `duration`; the step is then the nearest that divides it. fps: of the keys.
    integrator: of joints with a frequency, as masses on springs; "" for their exact solution.
    scale_aware: stiffness, gravity and radii are those of a model without scale.
    """

    duration: float | None = None
    step: float = DEFAULT_STEP_S
    warm_up: float = 0.0
    loop: bool = False
    fps: float = 60.0
    integrator: str = ""
    scale_aware: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class SpringResult:
    """The clip with the springs' rotation tracks, and the run's figures.

    joints: nodes of the joints, in the order of the chains. replaced: those that had a rotation track before.
    step: in seconds, as simulated. num_steps: from 0 s on, in one round of a loop. loop: of the loop, None for none.
    tails: (S, J, 3) m, of the joints at every step, in world space. max_rotation: rad, largest rotation of a joint from
    its rest. max_speed: m/s, of a tail. notes: lines for the user. elongation: (S, J) of bones,
    relative. energies: (S,) J, of masses of 1 kg relative to their goals.
    """

    clip: Clip
    joints: tuple[int, ...]
    replaced: tuple[int, ...]
    step: float
    num_steps: int
    duration: float
    tails: Floats
    max_rotation: float
    max_speed: float
    loop: LoopedMotion | None = None
    notes: tuple[str, ...] = ()
    elongation: Floats | None = None
    energies: Floats | None = None


def simulate_springs(
    skeleton: Skeleton, clip: Clip, bones: SpringBones, options: SpringOptions = SpringOptions()
) -> SpringResult:
    """Return the clip with rotation tracks for the joints of all chains, as they follow its motion.

    clip: the driver, evaluated at every step; without tracks it is the rest pose. Its other tracks stay as they are;
    rotation tracks of joints are replaced. Keys are LINEAR, at the steps or at `fps` frames per second, with an exact
    end.
    Raises FormatError for chains that don't fit the skeleton, RangeError for times out of range, UnsupportedError for
    more steps than the limit of memory allows, and UnstableError where numbers get too large.
    """
    check_hierarchy(skeleton, bones)
    chains, notes = drop_inert_joints(skeleton, bones.chains)
    bones = replace(bones, chains=chains)
    _check_integrator(bones, options.integrator)
    if options.scale_aware:
        bones = scale_bones(skeleton, bones)
    duration = clip.end - clip.start if options.duration is None else options.duration
    if options.duration is None and not duration > 0:
        raise RangeError("has no clip with a length", help="choose `duration`")
    steps, looped, motion = _run(skeleton, _from_zero(clip), bones, options, duration)
    frames = frame_times(0.0, duration, fps=options.fps)
    frames = frames[distinct_float32(frames)]
    rotations = _resample(motion.rotations, frames / steps.step_s)
    if looped is not None:
        rotations[-1] = np.where(quaternion.dot(rotations[-1], rotations[0])[:, None] < 0, -1.0, 1.0) * rotations[0]
    nodes = frozenset(bones.nodes)
    replaced = [track.node for track in clip.tracks if track.path == "rotation" and track.node in nodes]
    deflection = quaternion.angle_between(motion.rotations, skeleton.rotation[list(bones.nodes)])
    speeds = np.sqrt((np.diff(motion.tails, axis=0) ** 2).sum(axis=-1)) / steps.step_s
    return SpringResult(
        _merge(clip, bones.nodes, *_stored_keys(clip.start + frames, rotations)),
        bones.nodes,
        tuple(node for node in replaced if node is not None),
        steps.step_s,
        steps.num_steps,
        duration,
        motion.tails,
        float(deflection.max(initial=0.0)),
        float(speeds.max(initial=0.0)),
        looped,
        (
            *bones.notes,
            *notes,
            *uneven_joints(skeleton, bones),
            *(() if options.scale_aware else scaled_colliders(skeleton, bones)),
        ),
        motion.elongation,
        motion.energies.sum(axis=1),
    )


def _check_integrator(bones: SpringBones, integrator: str) -> None:
    if not integrator:
        return
    find_integrator(integrator)
    if any(joint.parameters.frequency is None for chain in bones.chains for joint in chain.joints):
        raise RangeError("`integrator` is for springs with a frequency", help="choose `frequency` and `damping_ratio`")


def _from_zero(clip: Clip) -> Clip:
    """The clip, begun at 0 s."""
    if clip.start == 0.0:
        return clip
    tracks = (
        track.with_keys(track.times - clip.start, track.values, track.in_tangents, track.out_tangents)
        for track in clip.tracks
    )
    return Clip(clip.name, tuple(tracks))


def _stored_keys(times: Floats, rotations: Floats) -> tuple[Floats, Floats]:
    """Times (F,) as float32 stores them, without those that fall together, and their rotations."""
    kept = distinct_float32(times)
    return freeze(times[kept].astype(np.float32).astype(np.float64)), rotations[kept]


def _run(
    skeleton: Skeleton, clip: Clip, bones: SpringBones, options: SpringOptions, duration: float
) -> tuple[Steps, LoopedMotion | None, SpringMotion]:
    """The steps, and the motion at each of them, from 0 s to the first at or after the duration."""
    check_number(duration, "duration")
    if not duration > 0:
        raise RangeError(f"`duration` is {duration:g} s (expected more than 0)")
    steps = Steps(options.step, duration, options.warm_up)
    if options.loop:
        num_steps = max(round(duration / options.step), MIN_LOOP_STEPS)
        steps = Steps(duration / num_steps, duration, options.warm_up)
    count = len(bones.nodes)
    sizes = {"step_bytes": STEP_BYTES * count, "frame_bytes": FRAME_BYTES * count}
    steps.check_memory(plural(count, "joint"), fps=options.fps, **sizes)
    solver = SpringSolver(skeleton, clip, bones, step=steps.step_s, integrator=options.integrator)
    solver.start(0.0)
    solver.warm_up(0.0, steps.num_warm_up_steps)
    if options.loop:
        looped = run_loop(solver, steps)
        return steps, looped, looped.motion
    return steps, None, solver.run(steps.times())


def _resample(rotations: Floats, at: Floats) -> Floats:
    """Rotations (F, J, 4) at fractional steps (F,) of rotations (S, J, 4), along the shorter arcs, signs continuous."""
    left = np.minimum(np.floor(at + STEP_TOLERANCE).astype(np.int64), len(rotations) - 1)
    right = np.minimum(left + 1, len(rotations) - 1)
    fraction = np.clip(at - left, 0.0, 1.0)
    fraction[fraction < STEP_TOLERANCE] = 0.0  # a step's own rotation stays as it is
    return quaternion.align_signs(quaternion.slerp(rotations[left], rotations[right], fraction[:, None]))


def _merge(clip: Clip, nodes: tuple[int, ...], times: Floats, rotations: Floats) -> Clip:
    """The clip with these rotation tracks, in place of those that it has for the nodes, or after all others."""
    axis = TimeAxis(times)
    new = {
        node: Track(node, "rotation", Interpolation.LINEAR, axis, rotations[:, j].copy())
        for j, node in enumerate(nodes)
    }
    tracks = [new.pop(track.node) if track.path == "rotation" and track.node in new else track for track in clip.tracks]
    return Clip(clip.name, (*tracks, *new.values()))
