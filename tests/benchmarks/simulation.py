"""Seconds of CPU of simulations: cloth by size and substeps, beside its peers, particles, and the elongation left.

    python -m tests.benchmarks.simulation

Compiling is left out: each kind runs once before. Cloth is a square of 1 m² and 200 g over 300 frames.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing.append import append_mesh, append_nodes
from anim.model import Clip
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.simulate import simulate_cloth
from anim.simulation.particles.emission import Births
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.obstacles import Floor
from anim.simulation.particles.solver import Contact, ParticleSolver
from anim.simulation.steps import Steps
from tests.benchmarks.cloth_peers import grid_faces, run_peers

CLOTHS = ((32, 10), (64, 10), (64, 20), (128, 10))  # vertices along an edge, substeps
PEER_SIZE = 64
PARTICLES, STEPS = 10_000, 2_400


def main() -> None:
    """Print a line for each run."""
    _cloth(4, 2, corners=False, seconds=0.1)
    for corners in (False, True):
        for size, substeps in CLOTHS:
            began = time.process_time()
            worst = _cloth(size, substeps, corners=corners)
            took = time.process_time() - began
            per = 1e9 * took / (size * size * 300 * substeps)
            where = "two corners" if corners else "an edge"
            say(f"cloth {size} × {size}, {substeps} substeps, held at {where}: {took:.2f} s, {per:.0f} ns per point")
            say(f"    and substep; stretched by {100 * worst:.1f} % at most")
    for name, seconds, worst in run_peers(PEER_SIZE):
        say(f"{name}, cloth {PEER_SIZE} × {PEER_SIZE}, held at an edge: {seconds:.2f} s, {100 * worst:.3g} % at most")
    _particles(Forces(), 4)
    for name, forces in (("gravity", Forces()), ("drag", Forces(linear_drag=0.1))):
        began = time.process_time()
        _particles(forces)
        say(f"{PARTICLES} particles, {STEPS} steps, floor, {name}: {time.process_time() - began:.2f} s")


def say(words: str) -> None:
    sys.stdout.write(f"{words}\n")


def _cloth(size: int, substeps: int, *, corners: bool, seconds: float = 299 / 60) -> float:
    positions, faces, pinned = _sheet(size, corners)
    document, mesh = append_mesh(Document({"asset": {"version": "2.0"}}, ()), "cloth", positions, faces)
    document, nodes = append_nodes(document, [{"name": "cloth", "mesh": mesh}])
    options = ClothOptions(substeps=substeps, duration=seconds)
    run = simulate_cloth(reader.scene(document), Clip("", ()), nodes[0], pinned, options)
    assert run.report.worst_stretch is not None
    return float(run.report.worst_stretch["fraction"])


def _sheet(size: int, corners: bool) -> tuple[Floats, Ints, Bools]:
    x, z = np.meshgrid(np.linspace(0, 1, size), np.linspace(0, 1, size), indexing="ij")
    positions = np.stack([x, np.ones_like(x), z], -1).reshape(-1, 3)
    pinned = positions[:, 0] == 0
    if corners:
        pinned &= np.isin(positions[:, 2], [0.0, 1.0])
    return positions, grid_faces(size), pinned


def _particles(forces: Forces, steps: int = STEPS) -> None:
    random = np.random.default_rng(0)
    shape = (PARTICLES, 3)
    births = Births(
        np.zeros(PARTICLES), np.full(PARTICLES, 99.0), random.uniform(0, 2, shape), random.normal(size=shape)
    )
    ParticleSolver(births, forces, (Floor(),), Contact(), "velocity-verlet").run(Steps(1 / 240, steps / 240), 4)


if __name__ == "__main__":
    main()
