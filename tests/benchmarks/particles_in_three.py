"""Milliseconds in three.js of particles as nodes and as joints of one skin, by their number.

    GLTF_THREE_DIR=FOLDER python -m tests.benchmarks.particles_in_three

Each file has that many particles alive for 2 s, on parabolas and with a key per frame (drag), and nothing else.
load: parse the file. bind: the first pose. frame: the median of 200 poses, mixer, world matrices, and the skeleton's
matrices; drawing is not in it, but its calls are counted. All are medians of five processes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.gltf.writing.append import append_nodes
from anim.model import Clip
from anim.simulation.particles.emission import Emitter
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.simulate import ParticleOptions, add_particles, simulate_particles

COUNTS = (100, 300, 1000, 2000)
SCRIPT = Path(__file__).parents[1] / "threejs" / "cost.mjs"


def main() -> None:
    """Print a line for each file."""
    folder = Path(os.environ["GLTF_THREE_DIR"]) / "node_modules" / "three"
    sys.stdout.write("particles path     form    kB    load ms  bind ms  frame ms  draws\n")
    for count in COUNTS:
        for name, forces in (("parabolas", Forces()), ("frames", Forces(linear_drag=1.0))):
            for form in ("node", "skin"):
                with tempfile.TemporaryDirectory() as away:
                    path = Path(away) / "particles.glb"
                    path.write_bytes(_particles(count, forces, form))
                    runs = [_cost(folder, path) for _ in range(5)]
                    cost = {key: float(np.median([run[key] for run in runs])) for key in runs[0]}
                    size = path.stat().st_size / 1e3
                sys.stdout.write(
                    f"{count:9} {name:9} {form:5} {size:7.0f} {cost['load']:8.1f} {cost['bind']:8.1f} "
                    f"{cost['frame']:9.2f} {cost['draws']:6.0f}\n"
                )


def _particles(count: int, forces: Forces, form: str) -> bytes:
    document, _ = append_nodes(Document({"asset": {"version": "2.0"}}, ()), [{"name": "emitter"}])
    options = ParticleOptions(forces, duration=2.0, estimate_error=False)
    emitter = Emitter((0,), rate=0.0, burst=count, lifetime=9.0, lifetime_variation=0.0)
    run = simulate_particles(reader.scene(document), Clip("", ()), emitter, options)
    return b"".join(bytes(part) for part in container.glb(add_particles(document, run, "particles", form=form)))


def _cost(folder: Path, path: Path) -> dict[str, float]:
    command = ["node", str(SCRIPT), str(folder), str(path), "particles"]
    found: dict[str, float] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return found


if __name__ == "__main__":
    main()
