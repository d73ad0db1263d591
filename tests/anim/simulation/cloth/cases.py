"""Sheets, scenes and steps of cloth for the tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import fixtures
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.gltf.writing.append import append_mesh, append_nodes
from anim.model import Clip, Scene
from anim.simulation.cloth.kernels.xpbd import step_frame
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.selection import select_vertices
from anim.simulation.cloth.simulate import ClothRun, simulate_cloth
from anim.simulation.cloth.solver import Environment

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
    distant, levels = np.zeros((0, 2), np.int32), np.zeros(1, np.int64)
    constraints = (edges, lengths, none, np.zeros(0), anchors, limits)
    measured = (np.zeros((substeps, 2), np.int64), np.zeros((substeps, 2)))
    step_frame(
        p,
        v,
        w,
        pinned,
        targets,
        *constraints,
        distant,
        np.zeros(0),
        levels,
        edges,
        lengths,
        order,
        faces,
        colliders,
        np.zeros((substeps, 3)),
        p.copy(),
        numbers,
        iterations,
        0,
        *measured,
    )


def flag() -> tuple[Scene, Clip, int, NDArray[np.bool_]]:
    """The flag of the fixtures, its clip, its node, and the vertices at the pole."""
    document = container.read(np.frombuffer(fixtures.build("flag"), np.uint8))
    scene = reader.scene(document)
    instance = next(each for each in scene.instances if each.mesh.name == "flag")
    pinned = select_vertices("x-min", instance, instance.mesh.positions, scene.skeleton.names, [])
    return scene, reader.clips(document)[0], instance.node, pinned
