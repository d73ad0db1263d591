"""Motion of one joint against closed forms: the damped oscillator, and the specification's rule in a few steps."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.errors import UnstableError
from anim.model import Clip, Skeleton
from anim.simulation.integrators import INTEGRATORS, Scalar
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.solver import SpringMotion, SpringSolver
from tests.clips import about, skeleton, track

LENGTH = 0.5
SMALL = 1e-5  # m, of a kick: the sphere is flat over it
TAIL = 2


class Linear:
    """The oscillator x″ = −ω² x − 2 ζ ω x′, written once more."""

    def __init__(self, omega: float, ratio: float) -> None:
        self.omega, self.ratio = omega, ratio

    def acceleration(self, time: Scalar, x: Floats, v: Floats) -> Floats:
        return -self.omega * (self.omega * x + 2 * self.ratio * v)

    def solve_implicit(self, time: Scalar, x: Floats, v: Floats, step: Scalar) -> Floats:
        """Solve (v₊ − v) / h = a(x + h v₊, v₊) for v₊ − v."""
        new = (v - step * self.omega**2 * x) / (1 + 2 * self.ratio * self.omega * step + (self.omega * step) ** 2)
        return np.asarray(new - v)


def pendulum() -> Skeleton:
    return skeleton([-1, 0, 1], translation=[[0, 0, 0], [0, 0, 0], [0, -LENGTH, 0]])


def swung(parameters: SpringParameters, driver: Clip, times: Floats, step: float, integrator: str = "") -> SpringMotion:
    bones = SpringBones((SpringChain("", (SpringJoint(1, TAIL, parameters),)),))
    solver = SpringSolver(pendulum(), driver, bones, step=step, integrator=integrator)
    solver.start(0.0)
    return solver.run(times)


def kicked(step: float, num_steps: int) -> tuple[Clip, Floats]:
    """A root that moves by SMALL along x in the first step, and the times of all steps."""
    times = step * np.arange(1.0, num_steps + 1)
    return Clip("", (track("translation", [0, step], np.outer([0, SMALL], [1, 0, 0])),)), times


@pytest.mark.parametrize("step", [1 / 240, 1 / 60, 0.05, 0.4])
@pytest.mark.parametrize("ratio", [0.0, 0.1, 1.0, 1.7])
@pytest.mark.parametrize("frequency", [0.5, 2.0, 25.0])
def test_the_oscillator_is_exact_at_any_step(frequency: float, ratio: float, step: float) -> None:
    """After a kick the deviation follows e″ + 2ζω e′ + ω² e = 0 from e(h) = e(0), e′: solved by matrix exponential."""
    driver, times = kicked(step, 40)
    motion = swung(SpringParameters(frequency=frequency, damping_ratio=ratio), driver, times, step)
    omega = 2 * np.pi * frequency
    matrix = np.array([[0.0, 1.0], [-omega * omega, -2 * ratio * omega]])
    values, vectors = np.linalg.eig(matrix + np.diag([0, 1e-9 * omega]) if ratio == 1 else matrix)
    first = np.array([0.0, -SMALL / step])  # the goal moves at constant speed through the first step, then stops
    over = [(vectors * np.exp(values * step)) @ np.linalg.inv(vectors)]
    state = (over[0] @ first).real
    expected = [state[0]]
    state[1] += SMALL / step
    for _ in times[1:]:
        state = (over[0] @ state).real
        expected.append(state[0])
    found = motion.tails[:, 0, 0] - SMALL
    assert np.abs(found - expected).max() < 1e-6 * SMALL * max(1.0, frequency)


def test_the_undamped_oscillator_neither_gains_nor_loses() -> None:
    driver, times = kicked(1 / 60, 3600)
    motion = swung(SpringParameters(frequency=3.0, damping_ratio=0.0), driver, times, 1 / 60)
    swing = np.abs(motion.tails[:, 0, 0] - SMALL)
    assert swing[:600].max() == pytest.approx(swing[-600:].max(), rel=1e-3)


@pytest.mark.parametrize("ratio", [0.0, 0.3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_mass_on_a_spring_moves_as_the_integrator_says(integrator: str, ratio: float) -> None:
    """After a kick the deviation is that of the lesson's oscillator, by the same integrator from the same state."""
    step, frequency = 1 / 60, 3.0
    driver, times = kicked(step, 60)
    parameters = SpringParameters(frequency=frequency, damping_ratio=ratio)
    motion = swung(parameters, driver, times, step, integrator)
    method, system = INTEGRATORS[integrator], Linear(2 * np.pi * frequency, ratio)
    state = (np.zeros((1, 3)), np.array([[-SMALL / step, 0, 0]]))
    expected = []
    for k in range(len(times)):
        state = method.step(system, k * step, *state, step)
        expected.append(state[0][0, 0])
        if k == 0:  # the goal stops
            state = (state[0], state[1] + [[SMALL / step, 0, 0]])
    assert motion.tails[:, 0, 0] - SMALL == pytest.approx(np.array(expected), abs=1e-3 * SMALL)


def test_a_step_beyond_the_limit_diverges() -> None:
    driver, times = kicked(1 / 60, 600)
    parameters = SpringParameters(frequency=25.0, damping_ratio=0.0)  # ωh = 2.6
    with pytest.raises(UnstableError, match="diverge at"):
        swung(parameters, driver, times, 1 / 60, "verlet")
    assert np.isfinite(swung(parameters, driver, times, 1 / 60, "rk4").tails).all()


@pytest.mark.parametrize("step", [1 / 60, 1.0, 100.0])
def test_no_step_is_unstable(step: float) -> None:
    """A stiff spring with a step far above its period stays at its length and comes to rest."""
    times = step * np.arange(1.0, 400)
    driver = Clip("", (track("rotation", [0, step], [[0, 0, 0, 1], [0, 0, 1, 0]]),))
    motion = swung(SpringParameters(frequency=500.0, damping_ratio=0.05), driver, times, step)
    assert np.linalg.norm(motion.tails[:, 0], axis=-1) == pytest.approx(LENGTH)
    np.testing.assert_allclose(motion.tails[-1, 0], [0, LENGTH, 0], atol=1e-6)


def test_gravity_makes_an_oscillator_sag_alike_at_every_step() -> None:
    parameters = SpringParameters(gravity=(1e-3, 0, 0), frequency=2.0, damping_ratio=1.0)
    for step in (1 / 240, 1 / 30):
        motion = swung(parameters, Clip("", ()), step * np.arange(1.0, 400), step)
        assert motion.tails[-1, 0, 0] == pytest.approx(1e-3 / (4 * np.pi) ** 2, rel=1e-4)


def test_steady_motion_causes_no_lag_of_an_oscillator() -> None:
    times = np.arange(1, 600) / 60
    driver = Clip("", (track("translation", [0, 10], [[0, 0, 0], [15, 0, 0]]),))
    motion = swung(SpringParameters(frequency=2.0), driver, times, 1 / 60)
    assert motion.tails[-1, 0, 0] == pytest.approx(15 * times[-1] / 10, abs=1e-6)


def test_verlet_in_two_steps_by_hand() -> None:
    """Gravity of 1 m/s along x for 0.1 s moves the tail by 0.1 m, then by that times 1 − drag and 0.1 m more."""
    parameters = SpringParameters(stiffness=0.0, drag=0.25, gravity=(1.0, 0, 0))
    motion = swung(parameters, Clip("", ()), np.array([0.1, 0.2]), 0.1)
    first = np.array([0.1, -LENGTH, 0])
    first *= LENGTH / np.linalg.norm(first)
    second = first + 0.75 * (first - [0, -LENGTH, 0]) + [0.1, 0, 0]
    np.testing.assert_allclose(motion.tails[:, 0], [first, second * LENGTH / np.linalg.norm(second)], atol=1e-15)


def test_verlet_depends_on_the_step_as_players_do() -> None:
    """Drag is per step, so that 240 Hz decays four times as fast: it is not rescaled, since players don't."""
    parameters = SpringParameters(stiffness=0.0, drag=0.1)
    driver = Clip("", (track("rotation", [0, 1e-9], about("z", [0, 11.5])),))
    decay = []
    for rate in (60, 240):
        motion = swung(parameters, driver, np.arange(1, 41) / rate, 1 / rate)
        moves = np.linalg.norm(np.diff(motion.tails[:, 0], axis=0), axis=-1)
        decay.append(moves)
    np.testing.assert_array_equal(*decay)
