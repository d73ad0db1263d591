"""Report of a simulation of spring bones."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from anim.errors import UnstableError
from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Prover
from anim.model import Clip, Skeleton
from anim.simulation.integrators import damped_limit
from anim.simulation.report import SimulationReport, advise_step
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.simulate import SpringOptions, SpringResult, simulate_springs
from anim.simulation.spring_bones.stability import compare_springs


def make_report(
    skeleton: Skeleton,
    bones: SpringBones,
    options: SpringOptions,
    result: SpringResult,
    error_estimate: float | None = None,
    penetration: float | None = None,
) -> SimulationReport:
    """Return the figures of a run. error_estimate: m, of `step_error`. penetration: m, of `deepest_penetration`."""
    frequencies = [joint.parameters.frequency for chain in bones.chains for joint in chain.joints]
    omega_h, limit, advice = _stability(bones, result.step, options.integrator)
    figures: dict[str, Any] = {
        "chains": len(bones.chains),
        "joints": len(result.joints),
        "colliders": len({index for chain in bones.chains for index in chain.colliders}),
        "oscillators": sum(each is not None for each in frequencies),
        "replaced_tracks": len(result.replaced),
        "max_rotation_deg": math.degrees(result.max_rotation),
        "max_tail_speed_m_per_s": result.max_speed,
    }
    if result.loop is not None:
        figures |= {"loop_rounds": result.loop.rounds, "loop_settled": result.loop.settled}
    return SimulationReport(
        "springs",
        step_s=result.step,
        num_steps=result.num_steps,
        fps=options.fps,
        duration_s=result.duration,
        warm_up_s=options.warm_up,
        integrator=options.integrator,
        omega_h=omega_h,
        omega_h_limit=limit,
        energy_j=_energy(result) if options.integrator else None,
        drift_per_s=_drift(result) if options.integrator else None,
        worst_stretch=_worst_stretch(result) if options.integrator else None,
        penetration_m=penetration,
        error_estimate_m=error_estimate,
        loop_seam_m=None if result.loop is None else result.loop.seam,
        figures=figures,
        advice=advice,
        compare=lambda: compare_springs(skeleton, bones, result.step, options.integrator),
    )


def report_divergence(
    skeleton: Skeleton, bones: SpringBones, options: SpringOptions, error: UnstableError
) -> UnstableError:
    """Return the error with a report up to its first bad step, and with advice on the step."""
    omega_h, limit, advice = _stability(bones, options.step, options.integrator)
    report = SimulationReport(
        "springs",
        options.step,
        0,
        options.fps,
        options.duration or 0.0,
        warm_up_s=options.warm_up,
        integrator=options.integrator,
        omega_h=omega_h,
        omega_h_limit=limit,
        first_bad_step=error.report if isinstance(error.report, int) else None,
        figures={"joints": len(bones.nodes)},
        advice=advice or error.help,
        compare=lambda: compare_springs(skeleton, bones, options.step, options.integrator),
    )
    return UnstableError(error.problem, where=error.where, help=advice or error.help).with_report(report)


def _stability(bones: SpringBones, step: float, integrator: str) -> tuple[float | None, float | None, str]:
    """ω·h and its limit of the joint nearest to it, and advice; None without a frequency, no limit when exact."""
    joints = {joint.parameters for chain in bones.chains for joint in chain.joints}
    pairs = {(2 * math.pi * each.frequency * step, each.damping_ratio) for each in joints if each.frequency is not None}
    if not pairs:
        return None, None, ""
    if not integrator:
        return max(omega_h for omega_h, _ in pairs), math.inf, ""
    found = [(omega_h, damped_limit(integrator, ratio), ratio) for omega_h, ratio in sorted(pairs)]
    omega_h, limit, ratio = max(found, key=lambda each: each[0] / (each[1] or 1e-9))
    return omega_h, limit, advise_step(omega_h, limit, step, integrator, damped_limit("rk4", ratio))


def _energy(result: SpringResult) -> dict[str, float] | None:
    if result.energies is None or not len(result.energies):
        return None
    ends = {"start": float(result.energies[0]), "end": float(result.energies[-1])}
    return ends | {"peak": float(result.energies.max())}


def _drift(result: SpringResult) -> float | None:
    """Change of energy per second, relative to its peak; what the driver does and damping count."""
    found = _energy(result)
    if found is None or not found["peak"] > 0:
        return None
    return (found["end"] - found["start"]) / found["peak"] / result.duration


def _worst_stretch(result: SpringResult) -> dict[str, Any] | None:
    if result.elongation is None or not result.elongation.size:
        return None
    step, joint = np.unravel_index(int(np.abs(result.elongation).argmax()), result.elongation.shape)
    where = [round(float(value), 6) for value in result.tails[step, joint]]
    return {"fraction": float(result.elongation[step, joint]), "where": where, "time_s": float(step * result.step)}


def step_error(
    prover: Prover, skeleton: Skeleton, clip: Clip, bones: SpringBones, options: SpringOptions, result: SpringResult
) -> float:
    """Return the largest distance in metres, on the surface and of tails, from the same run with half the step.

    prover: on the scene. Springs by VRM are another motion at another step, since drag is per step.
    """
    half = simulate_springs(skeleton, clip, bones, replace(options, step=result.step / 2))
    proof = largest_error(prover, result.clip, half.clip)
    common = min(len(result.tails), len(half.tails[::2]))  # the last step may begin before the end, and end after it
    apart = result.tails[:common] - half.tails[::2][:common]
    return max(proof.error.max_error, proof.bound or 0.0, float(np.sqrt((apart * apart).sum(axis=-1)).max(initial=0.0)))
