"""Report of a run of rigid bodies."""

from __future__ import annotations

import math

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.simulation.report import RunHistory, SimulationReport, advise_half_step
from anim.simulation.rigid_bodies.extents import smallest_radius
from anim.simulation.rigid_bodies.motion import RigidMotion
from anim.simulation.rigid_bodies.options import RigidOptions
from anim.simulation.rigid_bodies.rigid_scene import BodyKind, Frame, RigidScene
from anim.simulation.rigid_bodies.tracks import BodyTracks
from anim.simulation.steps import Steps

PENETRATION_PER_RADIUS = 0.2  # of the smallest body, from which a smaller step is advised
NO_ERRORS: Floats = np.empty(0)


def make_report(
    rigid: RigidScene,
    motion: RigidMotion,
    options: RigidOptions,
    steps: Steps,
    *,
    errors: Floats = NO_ERRORS,
    made: BodyTracks | None = None,
    seam: float | None = None,
    first_bad_step: int | None = None,
) -> SimulationReport:
    """Return the figures of a run, or of the part before its first bad step.

    errors: (S,) m, distance to the run with half the step, or empty. made: None without tracks.
    """
    speeds = _speeds(motion)
    kinds = [body.kind for body in rigid.bodies]
    fastest = float(speeds.max(initial=0.0))
    figures = {
        "bodies": len(rigid.moving),
        "static": kinds.count(BodyKind.STATIC),
        "animated": kinds.count(BodyKind.ANIMATED),
        "joints": len(rigid.joints),
        "impacts": 0 if made is None else made.num_impacts,
        "keys": 0 if made is None else sum(len(track.times) for track in made.tracks),
        "at_rest": _num_at_rest(motion),
        "max_speed_m_s": fastest,
        "max_step_m": fastest * steps.step_s,
        "joint_error_m": _joint_error(rigid, motion),
    }
    if seam is not None:
        figures["loop_rounds"] = motion.num_rounds
    total = _total_energy(motion)
    return SimulationReport(
        "rigid",
        steps.step_s,
        steps.num_steps,
        options.fps,
        options.duration,
        warm_up_s=options.warm_up,
        energy_j=_energy(total),
        drift_per_s=_drift(total, motion.energy_times),
        penetration_m=max(0.0, motion.penetration),
        first_bad_step=first_bad_step,
        error_estimate_m=float(errors.max()) if len(errors) else None,
        loop_seam_m=seam,
        figures=figures,
        advice=_advice(rigid, motion, steps, first_bad_step),
        history=_history(rigid, motion, total, errors),
    )


def _num_at_rest(motion: RigidMotion) -> int:
    return int((motion.positions[-1] == motion.positions[-2:][0]).all(axis=-1).sum()) if len(motion.positions) else 0


def _advice(rigid: RigidScene, motion: RigidMotion, steps: Steps, first_bad_step: int | None) -> str:
    finer = advise_half_step(steps.step_s)
    if first_bad_step is not None:
        return f"the simulation diverges at step {first_bad_step}: {finer}"
    deepest = PENETRATION_PER_RADIUS * smallest_radius(rigid, math.inf)
    if not motion.overlaps and motion.penetration > deepest:
        return f"bodies are up to {1000 * motion.penetration:.3g} mm inside others: {finer}"
    return ""


def _total_energy(motion: RigidMotion) -> Floats:
    """Total energy (E,) above that of the lowest position."""
    if not len(motion.energies):
        return np.empty(0)
    return np.asarray(motion.energies.sum(axis=1) - motion.energies[:, 1].min())


def _energy(total: Floats) -> dict[str, float] | None:
    return {"start": float(total[0]), "end": float(total[-1]), "peak": float(total.max())} if len(total) else None


def _drift(total: Floats, times: Floats) -> float | None:
    """Relative change of energy per second, of its peak; impacts and friction count."""
    peak = float(total.max(initial=0.0))
    return float(total[-1] - total[0]) / peak / float(times[-1]) if peak > 0 and times[-1] > 0 else None


def _history(rigid: RigidScene, motion: RigidMotion, total: Floats, errors: Floats) -> RunHistory:
    rows = np.clip(np.searchsorted(motion.times, motion.energy_times - 1e-9), 0, max(len(motion.times) - 1, 0))
    kinetic, potential = motion.energies.T if len(motion.energies) else (np.empty(0), np.empty(0))
    energies = {"total": total, "kinetic": kinetic, "potential": potential - potential.min(initial=np.inf)}
    order = {body: k for k, body in enumerate(rigid.moving)}
    joined = [[order[i] for i in joint.bodies] for joint in rigid.joints if all(i in order for i in joint.bodies)]
    edges = np.array(joined, np.int64).reshape(-1, 2)
    return RunHistory(
        motion.energy_times, energies, motion.positions[rows], edges, errors[rows] if len(errors) else errors
    )


def _speeds(motion: RigidMotion) -> Floats:
    if len(motion.times) < 2:
        return np.zeros(0)
    return np.asarray(np.linalg.norm(np.diff(motion.positions, axis=0), axis=-1) / motion.times[1])


def _joint_error(rigid: RigidScene, motion: RigidMotion) -> float:
    """Largest distance in metres of the ends of a joint that are fixed to each other."""
    order = {body: k for k, body in enumerate(rigid.moving)}
    largest = 0.0
    for joint in rigid.joints:
        fixed = {axis for each in joint.limits if not each.angular and each.min == each.max == 0 for axis in each.axes}
        known = [i < 0 or i in order or rigid.bodies[i].kind is BodyKind.STATIC for i in joint.bodies]
        if len(fixed) == 3 and all(known):
            ends = [_path(rigid, motion, order, i, own) for i, own in zip(joint.bodies, joint.frames, strict=True)]
            largest = max(largest, float(np.linalg.norm(ends[0] - ends[1], axis=-1).max(initial=0.0)))
    return largest


def _path(rigid: RigidScene, motion: RigidMotion, order: dict[int, int], body: int, own: Frame) -> Floats:
    """Positions (S, 3) of a joint's frame on a body."""
    if body in order:
        k = order[body]
        return motion.positions[:, k] + quaternion.rotate(motion.rotations[:, k], own.position)
    if body < 0:
        return own.position
    frame = rigid.bodies[body].frame
    return frame.position + quaternion.rotate(frame.rotation, own.position)
