"""Frames of a cloth by the solver that its options name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from anim.arrays import Floats
from anim.simulation.cloth.driver import ClothDriver
from anim.simulation.cloth.mass_spring_solver import as_mass_spring, run_mass_spring
from anim.simulation.cloth.model import ClothModel
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.solver import MAX_ELONGATION, run_xpbd

ELONGATION_PER_LIMIT = 0.5  # what solvers are left of the largest stretch, since one sweep moves the next edge


def run_solver(
    model: ClothModel, driver: ClothDriver, options: ClothOptions, **timing: Any
) -> Iterator[tuple[Floats, float]]:
    """Yield positions (P, 3) m and the energy in J at frames. timing: as of `run_xpbd`. Raises UnstableError."""
    fabric, environment = options.fabric, options.environment
    if options.solver == "mass-spring":
        system = as_mass_spring(model, fabric, environment, options.stiffness)
        return run_mass_spring(model, system, fabric, environment, driver, integrator=options.integrator, **timing)
    limits: dict[str, Any] = {
        "iterations": None,
        "max_elongation": min(MAX_ELONGATION, ELONGATION_PER_LIMIT * (options.max_stretch or 1.0)),
    }
    if options.solver == "relaxation":
        fabric = replace(fabric, stretch_compliance=0.0)
        limits = {"iterations": options.iterations, "max_elongation": None}
    return run_xpbd(model, fabric, environment, driver, tethers=options.tethers, **timing, **limits)
