"""Closed loops of cloth, and gusts that repeat."""

from __future__ import annotations

import numpy as np

from anim.simulation.cloth.model import Fabric
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.simulate import simulate_cloth
from anim.simulation.cloth.solver import Environment
from tests.anim.simulation.cloth.cases import (
    STILL,
    flag,
)


def test_a_loop_that_settles_ends_as_it_begins() -> None:
    scene, clip, node, pinned = flag()
    options = ClothOptions(fabric=Fabric(damping=3.0), environment=STILL, duration=3.0, loop=True)
    run = simulate_cloth(scene, clip, node, pinned, options)
    frames = run.cache.load_all().positions
    np.testing.assert_array_equal(frames[0], frames[-1])
    assert run.report.figures["loop_settled"]
    assert run.report.loop_seam_m is not None
    assert run.report.loop_seam_m < 1e-4
    free = ~pinned
    assert np.abs(np.diff(frames, axis=0)[[0, -1]])[:, free].max() > 1e-3  # and it moves through the seam


def test_a_loop_that_never_settles_is_blended_and_its_seam_reported() -> None:
    scene, clip, node, pinned = flag()
    options = ClothOptions(environment=Environment(wind=(6.0, 0, 2)), duration=3.0, loop=True)
    run = simulate_cloth(scene, clip, node, pinned, options)
    frames = run.cache.load_all().positions.astype(float)
    np.testing.assert_array_equal(frames[0], frames[-1])
    assert not run.report.figures["loop_settled"]
    assert run.report.loop_seam_m is not None
    assert run.report.loop_seam_m > 1e-3
    round_trip = np.concatenate([frames[:-1], frames[:3]])
    acceleration = np.linalg.norm(np.diff(round_trip, 2, axis=0), axis=2).max(axis=1)
    assert acceleration[-3:].max() <= acceleration[:-3].max()
    assert run.report.worst_stretch is not None
    assert run.report.worst_stretch["fraction"] < 0.1


def test_gusts_of_a_loop_repeat() -> None:
    times = np.linspace(0, 3, 50)
    wind = Environment(wind=(5.0, 0, 1), period=3.0)
    np.testing.assert_allclose(wind.wind_at(times + 3), wind.wind_at(times), atol=1e-9)
    assert np.ptp(wind.wind_at(times)[:, 0]) > 0.5
