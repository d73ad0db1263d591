"""Report of a simulation of spring bones."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Prover
from anim.model import Clip, Skeleton
from anim.simulation.report import SimulationReport
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.simulate import SpringOptions, SpringResult, simulate_springs


def make_report(
    bones: SpringBones,
    options: SpringOptions,
    result: SpringResult,
    error_estimate: float | None = None,
    penetration: float | None = None,
) -> SimulationReport:
    """Return the figures of a run. error_estimate: m, of `step_error`. penetration: m, of `deepest_penetration`."""
    frequencies = [joint.parameters.frequency for chain in bones.chains for joint in chain.joints]
    fastest = max((each for each in frequencies if each is not None), default=None)
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
        omega_h=None if fastest is None else 2 * math.pi * fastest * result.step,
        omega_h_limit=None if fastest is None else math.inf,
        penetration_m=penetration,
        error_estimate_m=error_estimate,
        loop_seam_m=None if result.loop is None else result.loop.seam,
        figures=figures,
    )


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
    return max(proof.error.max_error, proof.bound or 0.0, float(np.sqrt((apart * apart).sum(axis=-1)).max()))
