"""Closed loops of cloth, and gusts that repeat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.simulation.cloth.loop import MAX_ROUNDS, close_loop, loop_rows
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


@pytest.mark.slow
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


def test_the_seam_is_where_two_rounds_are_nearest() -> None:
    """Rounds of 60 frames differ by 1 mm at frame 40 of the clip, and by more before and after."""

    def frames() -> Iterator[tuple[Floats, float]]:
        for i in range(MAX_ROUNDS * 60 + 1):
            turn, phase = divmod(i, 60)
            apart = (-1) ** turn * (0.0005 + 0.01 * abs(phase - 40))  # from round to round twice this
            yield np.array([[np.sin(2 * np.pi * phase / 60), apart, 0.0]]), float(phase)

    positions, energies, seam = close_loop(frames(), 61, 60.0)
    assert (seam.rounds, seam.settled) == (MAX_ROUNDS, False)
    assert seam.distance < 0.15  # 2 cm for each frame from there
    assert abs(seam.first % 60 - 40) <= 8  # half of the frames that are blended
    np.testing.assert_allclose(positions[:, 0, 0], np.sin(2 * np.pi * np.arange(61) / 60), atol=1e-12)
    np.testing.assert_array_equal(positions[0], positions[-1])
    np.testing.assert_array_equal(energies[:60], np.arange(60))
    assert (loop_rows(seam.first, 60) % 60 == np.arange(61) % 60).all()


@pytest.mark.slow
def test_a_seam_inside_the_clip_leaves_pinned_points_on_it() -> None:
    scene, clip, node, pinned = flag()
    options = ClothOptions(environment=Environment(wind=(6.0, 0, 2)), duration=3.0, loop=True)
    looped = simulate_cloth(scene, clip, node, pinned, options).cache.load_all().positions
    plain = simulate_cloth(scene, clip, node, pinned, replace(options, loop=False)).cache.load_all().positions
    np.testing.assert_array_equal(looped[:180, pinned], plain[:180, pinned])


def test_gusts_of_a_loop_repeat() -> None:
    times = np.linspace(0, 3, 50)
    wind = Environment(wind=(5.0, 0, 1), period=3.0)
    np.testing.assert_allclose(wind.wind_at(times + 3), wind.wind_at(times), atol=1e-9)
    assert np.ptp(wind.wind_at(times)[:, 0]) > 0.5
