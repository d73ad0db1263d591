"""One cloth by every solver, for the plot of stability."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools
from anim.model import Clip, Scene
from anim.simulation.cloth.mass_spring_solver import as_mass_spring
from anim.simulation.cloth.model import build_cloth
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.comparison import Comparison, compare_integrators
from anim.skinning.bake import prepare_bake

COMPARED_S = 1.0  # of the integrators


def compare(scene: Scene, node: int, pinned: Bools, options: ClothOptions) -> Comparison:
    """Return the same cloth as masses and springs by every integrator, over a second at the pose of 0 s."""
    baker = prepare_bake(scene, rigid=True, nodes=[node])
    template = baker.bake(Clip("", ()), times=np.zeros(1))
    start = np.concatenate([chunk.positions for chunk in template.chunks()])[0].astype(np.float64)
    model = build_cloth(start, template.faces, pinned, options.fabric)
    system = as_mass_spring(model, options.fabric, options.environment, options.stiffness)
    x, v = model.rest, np.zeros_like(model.rest)
    step, duration = 1.0 / (options.fps * options.substeps), min(options.duration, COMPARED_S)
    damped = compare_integrators(system, x, v, step=step, duration=duration, names=["implicit-euler"])[0]
    lowest = float(damped.energies.min()) - 1e-3 * abs(float(np.ptp(damped.energies)))
    runs = compare_integrators(system, x, v, step=step, duration=duration, lowest_energy=lowest)
    return Comparison(runs, system.max_frequency() * step, step, model.topology.edges)
