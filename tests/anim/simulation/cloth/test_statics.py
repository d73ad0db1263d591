"""Cloth at rest against closed forms: length, catenary, weight."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from anim.simulation.cloth.model import Fabric
from tests.anim.simulation.cloth.cases import (
    STILL,
    G,
    one_edge,
    sheet,
    simulate,
)
from tests.files import mark_slow


@pytest.mark.parametrize("substeps", [1, 4, 16])
def test_static_elongation_is_weight_times_compliance_at_any_step(substeps: int) -> None:
    assert one_edge(1e-3, substeps) == pytest.approx(G * 1e-3, rel=1e-6)
    assert one_edge(1e-3, substeps, iterations=3) == pytest.approx(G * 1e-3, rel=1e-6)
    assert one_edge(0.0, substeps, iterations=5) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("solver", mark_slow(["xpbd", "relaxation"], slow=["relaxation"]))
def test_a_narrow_strip_hangs_as_a_catenary(solver: str) -> None:
    """A strip of 1 m whose ends are 0.8 m apart, folded up and down at the start."""
    positions, faces = sheet(2, 81, width=0.02)
    at = positions[:, 2] * 80
    zigzag = np.stack([positions[:, 0], 1 + 0.6 / 80 * (at.round() % 2), 0.01 * at], axis=1)
    assert np.linalg.norm(np.diff(zigzag[:81], axis=0), axis=1).sum() == pytest.approx(1)
    _, frames = simulate(
        zigzag,
        faces,
        np.isin(positions[:, 2], [0.0, 1.0]),
        fabric=Fabric(bend_compliance=1e9, stretch_compliance=0.0, damping=2.0),
        environment=STILL,
        substeps=40,
        duration=8.0,
        solver=solver,
    )
    a = brentq(lambda a: 2 * a * np.sinh(0.4 / a) - 1, 0.05, 50)
    shape = 1 - a * (np.cosh(0.4 / a) - np.cosh((frames[-1, :81, 2] - 0.4) / a))
    sag = a * (np.cosh(0.4 / a) - 1)
    assert np.abs(frames[-1, :81, 1] - shape).max() < 0.01 * sag


@pytest.mark.parametrize(("compliance", "coarse"), [(1e-2, 20), (1e-1, 5)])
def test_a_hanging_strip_is_as_long_as_its_compliance_says_at_any_step(compliance: float, coarse: int) -> None:
    positions, faces = sheet(2, 11, width=0.1)
    lengths = []
    for substeps, tethers in ((coarse, True), (40, True), (40, False)):
        fabric = Fabric(bend_compliance=1e9, stretch_compliance=compliance, damping=5.0)
        hung = positions[:, [0, 2, 1]] * [1, -1, 1]
        pinned = hung[:, 1] == 0
        run, frames = simulate(
            *(hung, faces, pinned), fabric=fabric, environment=STILL, substeps=substeps, duration=4.0, tethers=tethers
        )
        lengths.append(-frames[-1, :, 1].min())
        assert run.report.penetration_m is None
    np.testing.assert_allclose(lengths, lengths[0], rtol=2e-4)
    assert lengths[0] > 1 + 0.4 * compliance


@pytest.mark.parametrize("compliance", [0.0, 1e-7, 1e-5])
def test_a_stiff_fabric_hangs_at_its_length_at_any_step(compliance: float) -> None:
    """A percent longer it was, by limits that let every edge be longer."""
    positions, faces = sheet(16, 16)
    hung = positions[:, [0, 2, 1]] * [1, -1, 1]
    fabric = Fabric(stretch_compliance=compliance, damping=3.0)
    lengths = []
    for substeps, tethers in ((3, True), (10, True), (30, True), (30, False)):
        options = {"environment": STILL, "substeps": substeps, "duration": 2.0, "tethers": tethers}
        _, frames = simulate(hung, faces, hung[:, 1] == 0, fabric=fabric, **options)
        lengths.append(-frames[-1, :, 1].min())
    np.testing.assert_allclose(lengths, 1.0, atol=2e-4)
    np.testing.assert_allclose(lengths, lengths[0], rtol=5e-5)
