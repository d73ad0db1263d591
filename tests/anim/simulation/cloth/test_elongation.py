"""Elongation of cloth over a whole run, and the limits that it keeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.errors import UnstableError
from anim.model import Clip, Interpolation, Track
from anim.simulation.cloth.divergence import check_lengths
from anim.simulation.cloth.model import Fabric, build_cloth
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.simulate import simulate_cloth
from anim.simulation.cloth.topology import build_topology
from tests.anim.simulation.cloth.cases import (
    STILL,
    scene_of,
    sheet,
    simulate,
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "corners", "substeps", "limit"), [(64, False, 10, 0.03), (64, True, 20, 0.06), (128, False, 10, 0.03)]
)
def test_a_large_sheet_is_hardly_longer_at_any_time(size: int, corners: bool, substeps: int, limit: float) -> None:
    positions, faces = sheet(size, size)
    pinned = positions[:, 0] == 0
    if corners:
        pinned &= np.isin(positions[:, 2], [0.0, 1.0])
    run, _ = simulate(positions, faces, pinned, environment=STILL, duration=5.0, substeps=substeps)
    assert run.report.worst_stretch is not None
    assert run.report.worst_stretch["fraction"] <= limit


@pytest.mark.slow
@pytest.mark.parametrize("corners", [False, True])
@pytest.mark.parametrize("max_stretch", [0.02, 0.005])
def test_the_largest_stretch_is_met_over_the_whole_swing(corners: bool, max_stretch: float) -> None:
    positions, faces = sheet(24, 24)
    pinned = positions[:, 0] == 0
    if corners:
        pinned &= np.isin(positions[:, 2], [0.0, 1.0])
    options = {"environment": STILL, "duration": 1.5, "substeps": 1}
    loose, _ = simulate(positions, faces, pinned, **options)
    run, frames = simulate(positions, faces, pinned, **options, max_stretch=max_stretch)
    edges = build_topology(positions, faces, 1e-6).edges
    lengths, rest = (np.linalg.norm(np.diff(x[..., edges, :], axis=-2), axis=-1)[..., 0] for x in (frames, positions))
    assert (lengths / rest).max() - 1 <= max_stretch + 1e-5
    assert loose.report.worst_stretch is not None
    assert loose.report.worst_stretch["fraction"] > max_stretch
    assert run.report.figures["substeps"] > 1


def test_stretch_of_pinned_points_by_the_clip_is_no_divergence() -> None:
    """Two triangles, one pinned: the clip scales its edges to five times their rest length, as joints of a skin may."""
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
    scene, node = scene_of(np.vstack((triangle, triangle + np.array([3, 0, 0]))), np.arange(6).reshape(2, 3))
    scaling = Track(node, "scale", Interpolation.LINEAR, [0.0, 0.2], [[1, 1, 1], [5, 5, 5]])
    options = ClothOptions(duration=0.2)
    run = simulate_cloth(scene, Clip("grow", (scaling,)), node, np.arange(6) < 3, options)
    positions = run.cache.load_all().positions.astype(float)[-1]
    assert np.linalg.norm(positions[1] - positions[0]) == pytest.approx(5)
    assert np.linalg.norm(positions[4] - positions[3]) == pytest.approx(1, abs=0.01)


def test_the_elongation_of_every_step_is_in_the_report() -> None:
    """With frames of one step each, it is that of the positions."""
    positions, faces = sheet(10, 10)
    pinned = positions[:, 0] == 0
    coarse, _ = simulate(positions, faces, pinned, environment=STILL, duration=0.5, substeps=8, fps=60.0)
    fine, frames = simulate(positions, faces, pinned, environment=STILL, duration=0.5, substeps=1, fps=480.0)
    topology = build_topology(positions, faces, 1e-6)
    lengths, rest = (
        np.linalg.norm(np.diff(x[..., topology.edges, :], axis=-2), axis=-1)[..., 0] for x in (frames, positions)
    )
    stretch = lengths / rest - 1
    attached = pinned[topology.edges].sum(axis=1) == 1
    for run in (coarse, fine):
        worst = run.report.worst_stretch
        assert worst is not None
        assert worst["fraction"] == max(worst["free_edges"], worst["attached_edges"])
        assert worst["attached_edges"] == pytest.approx(stretch[:, attached].max(), abs=1e-5)
        assert worst["free_edges"] == pytest.approx(stretch[:, ~pinned[topology.edges].any(axis=1)].max(), abs=1e-5)
        frame = round(worst["time_s"] * 480)
        assert stretch[frame].max() == pytest.approx(worst["fraction"], abs=1e-5)


def test_the_stretch_that_the_animation_forces_is_stated_apart() -> None:
    """A point in the middle of three, whose outer two are moved apart by half."""
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, 1]])
    faces = np.array([[0, 3, 1], [1, 3, 4], [1, 4, 2], [2, 4, 5]])
    scene, node = scene_of(positions, faces)
    widening = Track(node, "scale", Interpolation.LINEAR, [0.0, 0.2], np.array([[1, 1, 1], [1.5, 1, 1]]))
    pinned = np.isin(positions[:, 0], [0.0, 2.0])
    run = simulate_cloth(scene, Clip("widen", (widening,)), node, pinned, ClothOptions(duration=0.2))
    worst = run.report.worst_stretch
    assert worst is not None
    assert worst["attachment"] == pytest.approx(0.5, abs=1e-6)
    assert worst["attached_edges"] >= 0.5 - 1e-3


def test_a_single_short_edge_that_is_long_is_no_divergence() -> None:
    """An edge of 1 mm where a point of the sheet meets a pinned one that the clip moves away."""
    positions, faces = sheet(40, 40)
    model = build_cloth(positions, faces, positions[:, 0] == 0, Fabric())
    edges = model.topology.edges
    length = np.array(model.edge_lengths)
    length[5] = 1e-3
    short = replace(model, edge_lengths=length)
    check_lengths(short, model.rest, 0.0, 1)
    with pytest.raises(UnstableError, match="frame 7"):
        check_lengths(short, 4 * model.rest, 0.0, 7)  # every edge
    torn = np.array(model.rest)
    torn[edges[-1, 0]] += [0, 1, 0]
    with pytest.raises(UnstableError, match="diverges"):
        check_lengths(model, torn, 0.0, 1)
