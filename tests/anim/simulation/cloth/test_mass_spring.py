"""Cloth as masses and springs, and by relaxation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.errors import UnstableError
from anim.simulation.cloth.mass_spring_solver import as_mass_spring
from anim.simulation.cloth.model import Fabric, build_cloth
from anim.simulation.integrators import INTEGRATORS, integrate
from tests.anim.simulation.cloth.cases import (
    STILL,
    Array,
    sheet,
    simulate,
)
from tests.files import mark_slow


def test_a_mass_spring_cloth_beyond_its_limit_is_an_error_with_advice() -> None:
    positions, faces = sheet(8, 8)
    options = {"solver": "mass-spring", "stiffness": 800.0, "environment": STILL, "duration": 1.0}
    with pytest.raises(UnstableError, match="diverges at frame") as caught:
        simulate(positions, faces, positions[:, 0] == 0, **options, substeps=1)
    assert "limit is 2: --step 1/" in caught.value.help
    step = int(caught.value.help.split("--step 1/")[1].split()[0])
    run, _ = simulate(positions, faces, positions[:, 0] == 0, **options, substeps=-(-step // 60))
    assert run.report.omega_h is not None
    assert run.report.omega_h < 2
    assert run.report.energy_j is not None
    assert run.report.energy_j["peak"] <= run.report.energy_j["start"] * 1.01 + 0.01


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["symplectic-euler", "verlet", "rk4", "implicit-euler"])
def test_integrators_agree_at_small_steps(integrator: str) -> None:
    positions, faces = sheet(5, 5)
    options = {"solver": "mass-spring", "stiffness": 100.0, "environment": STILL, "duration": 0.3, "substeps": 60}
    _, expected = simulate(positions, faces, positions[:, 0] == 0, **options)
    _, found = simulate(positions, faces, positions[:, 0] == 0, **options, integrator=integrator)
    assert np.abs(found - expected).max() < 0.01


@pytest.mark.parametrize(
    "name",
    mark_slow(["symplectic-euler", "velocity-verlet", "rk4", "implicit-euler"], ["velocity-verlet", "implicit-euler"]),
)
def test_the_mass_spring_cloth_converges_with_the_order_of_its_integrator(name: str) -> None:
    """Undamped, so that forces depend on positions alone; against RK4 with an eighth of the step."""
    positions, faces = sheet(5, 5)
    model = build_cloth(positions, faces, positions[:, 0] == 0, Fabric(damping=0.0))
    system = as_mass_spring(model, Fabric(damping=0.0), STILL, 50.0)
    system = replace(system, damping=np.zeros_like(system.damping))
    x = model.rest + 0.02 * np.random.default_rng(1).standard_normal(model.rest.shape) * system.is_free[:, None]

    def end(name: str, steps: int) -> Array:
        *_, (found, _) = integrate(system, name, x, np.zeros_like(x), 0.08 / steps, steps)
        return found

    exact = end("rk4", 4096)
    errors = [float(np.abs(end(name, steps) - exact).max()) for steps in (256, 512)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(INTEGRATORS[name].order, abs=0.2)


@pytest.mark.parametrize("name", ["verlet", "velocity-verlet", "symplectic-euler"])
def test_a_free_mass_spring_cloth_keeps_momentum_and_angular_momentum(name: str) -> None:
    positions, faces = sheet(5, 5)
    model = build_cloth(positions, faces, np.zeros(25, bool), Fabric(damping=0.0))
    system = as_mass_spring(model, Fabric(damping=0.0), replace(STILL, gravity=(0.0, 0.0, 0.0)), 50.0)
    method, h = INTEGRATORS[name], 1 / 2000
    v = np.cross([1.0, 2, 3], positions) + np.random.default_rng(0).standard_normal(positions.shape)
    m = system.masses[:, None]
    state, first = method.start(system, 0.0, positions, v, h), (m * v).sum(0)
    spin = [np.cross(state[0], m * method.velocity(system, 0.0, state, h)).sum(axis=0)]
    for _ in range(500):
        state = method.step(system, 0.0, *state, h)
    spin.append(np.cross(state[0], m * method.velocity(system, 0.0, state, h)).sum(axis=0))
    np.testing.assert_allclose((m * method.velocity(system, 0.0, state, h)).sum(axis=0), first, atol=1e-12)
    np.testing.assert_allclose(spin[1], spin[0], rtol=2e-3)


def test_relaxation_is_stiffer_with_more_iterations() -> None:
    positions, faces = sheet(12, 12)
    stretch = []
    for iterations in (2, 30):
        options = {"solver": "relaxation", "iterations": iterations, "substeps": 1, "tethers": False, "duration": 2.0}
        run, _ = simulate(positions, faces, positions[:, 0] == 0, **options)
        assert run.report.worst_stretch is not None
        stretch.append(run.report.worst_stretch["at_end"])
    assert stretch[1] < 0.3 * stretch[0]
