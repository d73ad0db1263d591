"""Cloth against closed forms: catenary, static stretch, free fall, colliders; and its topology."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

import fixtures
from anim.errors import NotFoundError, RangeError, UnstableError
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.gltf.writing.append import append_mesh, append_nodes
from anim.model import Clip, Interpolation, Scene, Track
from anim.sampling.sample import sample
from anim.simulation.cloth.colliders import Capsule, Plane, from_spring_colliders
from anim.simulation.cloth.driver import ClothDriver
from anim.simulation.cloth.kernels.self_collision import separate_points
from anim.simulation.cloth.kernels.xpbd import step_frame
from anim.simulation.cloth.mass_spring_solver import as_mass_spring
from anim.simulation.cloth.model import Fabric, build_cloth
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.selection import select_vertices
from anim.simulation.cloth.simulate import ClothRun, simulate_cloth
from anim.simulation.cloth.solver import Environment
from anim.simulation.cloth.tethers import tether_lengths
from anim.simulation.cloth.topology import build_topology
from anim.simulation.integrators import INTEGRATORS, integrate
from anim.simulation.spring_bones.colliders import Collider, ColliderShape
from anim.skinning.bake import bake, prepare_bake

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
G = 9.81
STILL = Environment(air=1.2)


def sheet(rows: int, columns: int, width: float = 1.0, length: float = 1.0) -> tuple[Array, Indices]:
    """A sheet in the plane y = 1: x across, z along."""
    x, z = np.meshgrid(np.linspace(0, width, rows), np.linspace(0, length, columns), indexing="ij")
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])
    return np.stack([x, np.ones_like(x), z], -1).reshape(-1, 3), faces


def scene_of(positions: Array, faces: Indices) -> tuple[Scene, int]:
    document, mesh = append_mesh(Document({"asset": {"version": "2.0"}}, ()), "cloth", positions, faces)
    document, nodes = append_nodes(document, [{"name": "cloth", "mesh": mesh}])
    return reader.scene(document), nodes[0]


def simulate(positions: Array, faces: Indices, pinned: NDArray[Any], **options: object) -> tuple[ClothRun, Array]:
    scene, node = scene_of(positions, faces)
    run = simulate_cloth(scene, Clip("", ()), node, np.asarray(pinned, bool), ClothOptions(**options))  # type: ignore[arg-type]
    return run, run.cache.load_all().positions.astype(float)


def one_edge(compliance: float, substeps: int, iterations: int = 1) -> float:
    """Elongation in metres of a vertical edge of 1 m with 1 kg at its end, at rest."""
    p, v = np.array([[0.0, 0, 0], [0, -1, 0]]), np.zeros((2, 3))
    for _ in range(1200):
        about = compliance, G, 9.0, iterations
        advance(p, v, np.array([0.0, 1]), np.array([[0, 1]]), np.ones(1), substeps, about)
    return float(-p[1, 1] - 1)


def advance(
    p: Array,
    v: Array,
    w: Array,
    edges: Indices,
    lengths: Array,
    substeps: int,
    about: tuple[float, float, float, int],
) -> None:
    """Move points whose first is pinned if w[0] is 0; about: compliance, gravity, damping, iterations."""
    compliance, gravity, damping, iterations = about
    h = 1 / 60 / substeps
    none, pinned = np.zeros((0, 2), np.int64), np.flatnonzero(w == 0)
    targets = np.broadcast_to(p[pinned], (substeps, len(pinned), 3)).copy()
    anchors, limits = np.full((len(p), 1), -1), np.zeros((len(p), 1))
    order, faces, colliders = np.arange(len(edges)), np.zeros((0, 3), np.int64), np.zeros((substeps + 1, 0, 8))
    numbers = np.array([h, 0, -gravity, 0, compliance, 0, damping, 0, -1e30, 0, 0, 0])
    constraints = (edges, lengths, none, np.zeros(0), anchors, limits, edges, lengths, order)
    step_frame(
        p,
        v,
        w,
        pinned,
        targets,
        *constraints,
        faces,
        colliders,
        np.zeros((substeps, 3)),
        p.copy(),
        numbers,
        iterations,
        0,
    )


# Topology.


def test_vertices_at_one_place_are_one_point() -> None:
    positions, faces = sheet(4, 5)
    split, corners = positions[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
    whole, welded = build_topology(positions, faces, 1e-6), build_topology(split, corners, 1e-6)
    assert len(welded.first_vertex) == 20
    assert len(welded.edges) == len(whole.edges) == 20 + len(faces) - 1  # Euler's formula of a disk
    np.testing.assert_array_equal(split[welded.first_vertex][welded.point_of_vertex], split)
    inner = len(whole.edges) - 2 * (3 + 4)
    assert len(whole.hinges) == inner


def test_neighbors_in_the_order_of_edges_share_no_point() -> None:
    positions, faces = sheet(20, 20)
    edges = build_topology(positions, faces, 1e-6).edges
    shared = [bool(set(a) & set(b)) for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)]
    assert sum(shared) < 12  # where the color changes


def test_tethers_are_as_long_as_the_mesh() -> None:
    positions, faces = sheet(30, 30)
    topology = build_topology(positions, faces, 1e-6)
    anchors, lengths = tether_lengths(topology, positions, np.array([0, 29]))
    straight = np.linalg.norm(positions[:, None] - positions[[0, 29]][None], axis=2)
    np.testing.assert_allclose(lengths[:, 0], straight.min(axis=1), rtol=0.03)
    assert {0, 29} <= set(anchors[435].tolist())  # a point between both corners is held by both
    half = np.array([[np.cos(a), 0, np.sin(a)] for a in np.linspace(0, np.pi, 60)])  # a half cylinder
    around = np.concatenate([half, half + np.array([0, 0.05, 0])])
    at = np.arange(59)
    folded = np.concatenate([np.stack([at, at + 60, at + 1], 1), np.stack([at + 1, at + 60, at + 61], 1)])
    _, lengths = tether_lengths(build_topology(around, folded, 1e-6), around, np.array([0]))
    np.testing.assert_allclose(lengths[59, 0], np.pi, rtol=0.02)
    assert (anchors[:, 0] >= 0).all()


# Statics and dynamics.


@pytest.mark.parametrize("substeps", [1, 4, 16])
def test_static_elongation_is_weight_times_compliance_at_any_step(substeps: int) -> None:
    assert one_edge(1e-3, substeps) == pytest.approx(G * 1e-3, rel=1e-6)
    assert one_edge(1e-3, substeps, iterations=3) == pytest.approx(G * 1e-3, rel=1e-6)
    assert one_edge(0.0, substeps, iterations=5) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("solver", ["xpbd", "relaxation"])
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


def test_momentum_is_conserved_and_angular_momentum_converges_to_it() -> None:
    positions, faces = sheet(6, 6)
    topology = build_topology(positions, faces, 1e-6)
    lengths = np.linalg.norm(positions[topology.edges[:, 0]] - positions[topology.edges[:, 1]], axis=1)
    random = np.random.default_rng(2)
    w = random.uniform(5, 20, 36)
    spin = np.cross([0.3, 2.0, 0.5], positions - positions.mean(axis=0)) + 0.3 * random.standard_normal((36, 3))
    lost = []
    for substeps in (10, 20, 40):
        p, v = positions.copy(), spin.copy()
        before = (v / w[:, None]).sum(axis=0), np.cross(p, v / w[:, None]).sum(axis=0)
        for _ in range(30):
            advance(p, v, w, topology.edges, lengths, substeps, (1e-4, 0.0, 0.0, 2))
        np.testing.assert_allclose((v / w[:, None]).sum(axis=0), before[0], atol=1e-12)
        after = np.cross(p, v / w[:, None]).sum(axis=0)
        lost.append(np.linalg.norm(after - before[1]) / np.linalg.norm(before[1]))
    assert lost[0] < 0.1
    assert lost[1] < 0.6 * lost[0]
    assert lost[2] < 0.6 * lost[1]


def test_free_fall_is_rigid() -> None:
    positions, faces = sheet(6, 6)
    _, frames = simulate(positions, faces, np.zeros(36), fabric=Fabric(damping=0.0), environment=STILL, duration=0.5)
    t = np.arange(31) / 60
    expected = positions + np.array([0, -1, 0]) * (0.5 * G * t**2 + 0.5 * G * t / 600)[:, None, None]
    np.testing.assert_allclose(frames, expected, atol=1e-6)


def test_a_sheet_held_at_an_edge_keeps_its_length_and_the_same_seed_its_bytes() -> None:
    positions, faces = sheet(20, 20)
    options = {"environment": Environment(wind=(3, 0, 1), seed=5), "duration": 2.0, "estimate_error": False}
    run, frames = simulate(positions, faces, positions[:, 0] == 0, **options)
    _, again = simulate(positions, faces, positions[:, 0] == 0, **options)
    assert frames.tobytes() == again.tobytes()
    fixed = positions[:, 0] == 0
    assert np.abs(frames[:, fixed] - positions[fixed]).max() < 1e-6
    assert run.report.worst_stretch is not None
    assert run.report.worst_stretch["at_end"] < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("corners", "substeps", "limit"), [(False, 10, 0.03), (True, 20, 0.06)])
def test_a_large_sheet_is_hardly_longer_at_any_time(corners: bool, substeps: int, limit: float) -> None:
    positions, faces = sheet(64, 64)
    pinned = positions[:, 0] == 0
    if corners:
        pinned &= np.isin(positions[:, 2], [0.0, 1.0])
    run, _ = simulate(positions, faces, pinned, environment=STILL, duration=5.0, substeps=substeps)
    assert run.report.worst_stretch is not None
    assert run.report.worst_stretch["fraction"] <= limit


@pytest.mark.parametrize("corners", [False, True])
@pytest.mark.parametrize("max_stretch", [0.02, 0.005])
def test_the_largest_stretch_is_met_over_the_whole_swing(corners: bool, max_stretch: float) -> None:
    positions, faces = sheet(24, 24)
    pinned = positions[:, 0] == 0
    if corners:
        pinned &= np.isin(positions[:, 2], [0.0, 1.0])
    options = {"environment": STILL, "duration": 2.0, "substeps": 3}
    loose, _ = simulate(positions, faces, pinned, **options)
    run, frames = simulate(positions, faces, pinned, **options, max_stretch=max_stretch)
    edges = build_topology(positions, faces, 1e-6).edges
    lengths, rest = (np.linalg.norm(np.diff(x[..., edges, :], axis=-2), axis=-1)[..., 0] for x in (frames, positions))
    assert (lengths / rest).max() - 1 <= max_stretch + 1e-5
    assert loose.report.worst_stretch is not None
    assert loose.report.worst_stretch["fraction"] > max_stretch
    assert run.report.figures["substeps"] > 3


def test_cloth_stays_out_of_colliders_and_above_the_floor() -> None:
    positions, faces = sheet(16, 16)
    ball = Capsule((0.5, 0.6, 0.5), (0.5, 0.6, 0.5), 0.25)
    _, frames = simulate(
        *(positions, faces, np.zeros(256)), environment=replace(STILL, floor=0.0), obstacles=(ball,), duration=3.0
    )
    away = np.linalg.norm(frames - [0.5, 0.6, 0.5], axis=2)
    assert away.min() >= 0.25 + 0.005 - 1e-6
    assert frames[..., 1].min() >= 0.005 - 1e-6


@pytest.mark.parametrize(("friction", "slides"), [(0.2, True), (0.7, False)])
def test_a_sheet_on_an_incline_slides_by_coulombs_law(friction: float, slides: bool) -> None:
    positions, faces = sheet(6, 6, width=0.5, length=0.5)
    angle = np.radians(30)
    down, up = np.array([np.cos(angle), -np.sin(angle), 0]), np.array([np.sin(angle), np.cos(angle), 0])
    start = positions[:, [0]] * down + positions * [0, 0, 1] + 0.005 * up
    plane = Plane((0.0, 0.0, 0.0), (float(up[0]), float(up[1]), 0.0))
    fabric = Fabric(damping=0.0, friction=friction)
    _, frames = simulate(
        *(start, faces, np.zeros(36)), fabric=fabric, environment=STILL, obstacles=(plane,), duration=1.0
    )
    path = (frames - frames[0]) @ down
    expected = 0.5 * G * (np.sin(angle) - friction * np.cos(angle)) if slides else 0.0
    np.testing.assert_allclose(path[-1], expected, rtol=5e-3, atol=1e-5)
    np.testing.assert_allclose(frames @ up, 0.005, atol=1e-5)


@pytest.mark.parametrize("kind", ["sphere", "capsule", "plane", "inside sphere", "inside capsule"])
def test_free_cloth_stays_on_its_side_of_every_collider_of_spring_bones(kind: str) -> None:
    positions, faces = sheet(12, 12)
    shape, inside = ColliderShape(kind.split()[-1]), kind.startswith("inside")
    offset, tail, radius = (0.5, 0.5, 0.2), (0.5, 0.6, 0.8), 0.2
    if inside:
        offset, tail, radius = (0.5, 0.9, 0.4), (0.5, 0.9, 0.6), 0.8
    given = Collider(None, shape, offset, tail, (0.2, 1.0, 0.0), radius, inside)
    run, frames = simulate(
        *(positions, faces, np.zeros(144)), environment=STILL, obstacles=from_spring_colliders([given]), duration=1.5
    )
    assert run.report.penetration_m == 0.0
    delta, axis = frames - offset, np.subtract(tail, offset) if shape is ColliderShape.CAPSULE else np.zeros(3)
    t = np.clip(delta @ axis / max(axis @ axis, 1e-30), 0, 1)
    distance = np.linalg.norm(delta - t[..., None] * axis, axis=2)
    if shape is ColliderShape.PLANE:
        assert (delta @ [0.2, 1.0, 0.0] / np.hypot(0.2, 1)).min() > 0.005 - 1e-5
    elif inside:
        assert distance.max() < radius - 0.005 + 1e-5
    else:
        assert distance.min() > radius + 0.005 - 1e-5


def test_colliders_move_with_their_nodes_at_every_substep() -> None:
    scene, clip, node, pinned = flag()
    pole = scene.skeleton.names.index("pole")
    obstacles = (Capsule((0.3, 1.0, 0), (0.3, 1.5, 0), 0.1, pole, pole), Plane((0, 0.5, 0), (0, 1, 0), pole))
    driver = ClothDriver(prepare_bake(scene, rigid=True, nodes=[node]), clip, np.flatnonzero(pinned), scene, obstacles)
    times = np.linspace(0.1, 0.2, 61)
    rows = driver.colliders(times)
    world = sample(scene.skeleton, clip, times, space="world").world
    assert world is not None
    expected = world[:, pole, :, :3] @ [0.3, 1.0, 0] + world[:, pole, :, 3]
    np.testing.assert_allclose(rows[:, 0, :3], expected, atol=1e-12)
    np.testing.assert_allclose(rows[:, 1, 3:6], world[:, pole, :, 1], atol=1e-12)
    assert (np.linalg.norm(np.diff(rows[:, 0, :3], axis=0), axis=1) > 1e-5).all()


def test_a_folded_strip_does_not_pass_through_itself() -> None:
    """A strip dropped on end folds over itself; layers keep apart by the thickness."""
    positions, faces = sheet(5, 41, width=0.1)
    z = positions[:, 2]
    start = np.stack([positions[:, 0], 0.01 + z, 0.002 * np.sin(9 * z)], axis=1)
    options: dict[str, Any] = {"fabric": Fabric(friction=1.0), "environment": Environment(floor=0.0), "substeps": 20}
    closest = []
    for own in (False, True):
        _, frames = simulate(start, faces, np.zeros(len(start)), **options, self_collision=own)
        end = frames[-1]
        far = np.linalg.norm(start[:, None] - start[None], axis=2) > 0.08
        closest.append(np.linalg.norm(end[:, None] - end[None], axis=2)[far].min())
    assert closest[0] < 0.01
    assert closest[1] > 0.018


def test_points_of_a_cloth_keep_apart_but_for_those_near_at_rest() -> None:
    p = np.array([[0.0, 0, 0], [0.04, 0, 0], [0.5, 0, 0], [0.52, 0, 0]])
    at_rest = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0.52, 0, 0]])
    separate_points(p, np.array([1.0, 3, 1, 1]), at_rest, 0.1)
    np.testing.assert_allclose(p[:2, 0], [-0.015, 0.085], atol=1e-12)
    np.testing.assert_array_equal(p[2:], at_rest[2:])


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


@pytest.mark.parametrize("integrator", ["symplectic-euler", "verlet", "rk4", "implicit-euler"])
def test_integrators_agree_at_small_steps(integrator: str) -> None:
    positions, faces = sheet(5, 5)
    options = {"solver": "mass-spring", "stiffness": 100.0, "environment": STILL, "duration": 0.3, "substeps": 60}
    _, expected = simulate(positions, faces, positions[:, 0] == 0, **options)
    _, found = simulate(positions, faces, positions[:, 0] == 0, **options, integrator=integrator)
    assert np.abs(found - expected).max() < 0.01


@pytest.mark.parametrize("name", ["symplectic-euler", "velocity-verlet", "rk4", "implicit-euler"])
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


# The animated body.


def test_pinned_vertices_follow_the_skin_at_every_frame() -> None:
    document = container.read(np.frombuffer(fixtures.build("arm"), np.uint8))
    scene, clip = reader.scene(document), reader.clips(document)[0]
    instance = scene.instances[0]
    positions = instance.mesh.positions
    pinned = ~select_vertices("y-max", instance, positions, scene.skeleton.names, [])
    run = simulate_cloth(scene, clip, instance.node, pinned, ClothOptions(fps=24, duration=1.0))
    times = np.arange(25) / 24
    expected = bake(scene, clip, times=times, rigid=True, nodes=[instance.node]).load_all().positions
    np.testing.assert_allclose(run.cache.load_all().positions[1:, pinned], expected[1:, pinned], atol=1e-6)


@pytest.mark.parametrize(
    ("selector", "error"),
    [("top", RangeError), ("joint:nobody", NotFoundError), ("material:*x", NotFoundError), ("box:0,0,0,1", RangeError)],
)
def test_selectors_without_sense_are_refused(selector: str, error: type[Exception]) -> None:
    scene = reader.scene(container.read(np.frombuffer(fixtures.build("arm"), np.uint8)))
    instance = scene.instances[0]
    with pytest.raises(error):
        select_vertices(selector, instance, instance.mesh.positions, scene.skeleton.names, ["skin"])


def test_vertices_are_selected_by_joint_weights_and_material() -> None:
    scene = reader.scene(container.read(np.frombuffer(fixtures.build("arm"), np.uint8)))
    instance, names = scene.instances[0], scene.skeleton.names
    joints = [names[node] for node in instance.skin.joints] if instance.skin else []
    found = sum(
        select_vertices(f"joint:{name}", instance, instance.mesh.positions, names, []).astype(int)
        for name in joints
        if (instance.mesh.weights * (instance.mesh.joints == joints.index(name))).sum(axis=1).max() >= 0.5
    )
    assert np.asarray(found).min() >= 0
    assert np.asarray(found).max() >= 1


def test_a_mesh_without_free_points_or_edges_is_refused() -> None:
    positions, faces = sheet(3, 3)
    with pytest.raises(NotFoundError, match="every point"):
        simulate(positions, faces, np.ones(9))
    with pytest.raises(NotFoundError, match="no edges"):
        build_topology(positions, faces[:0], 1e-6)
    with pytest.raises(RangeError, match="density"):
        Fabric(density=-1.0)


# Loops.


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


def flag() -> tuple[Scene, Clip, int, NDArray[np.bool_]]:
    """The flag of the fixtures, its clip, its node, and the vertices at the pole."""
    document = container.read(np.frombuffer(fixtures.build("flag"), np.uint8))
    scene = reader.scene(document)
    instance = next(each for each in scene.instances if each.mesh.name == "flag")
    pinned = select_vertices("x-min", instance, instance.mesh.positions, scene.skeleton.names, [])
    return scene, reader.clips(document)[0], instance.node, pinned


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
