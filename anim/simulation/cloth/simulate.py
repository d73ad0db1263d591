"""Scene + clip + options → vertex cache of a cloth, and its report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import RangeError, UnstableError
from anim.model import Clip, FrameChunk, Scene, VertexCache
from anim.simulation.cloth.driver import ClothDriver, bake_vertices
from anim.simulation.cloth.elongation import ElongationRecord, join_elongations, measure_elongation
from anim.simulation.cloth.loop import MAX_ROUNDS, close_loop, loop_rows
from anim.simulation.cloth.model import ClothModel, build_cloth
from anim.simulation.cloth.options import SOLVERS, ClothOptions
from anim.simulation.cloth.report import ClothFrames, make_failed_report, make_report
from anim.simulation.cloth.runs import run_solver
from anim.simulation.report import SimulationReport
from anim.simulation.steps import Steps
from anim.skinning.bake import prepare_bake

MAX_SUBSTEPS = 80


@dataclass(frozen=True, slots=True, eq=False)
class ClothRun:
    """Frames of all vertices of the mesh, and the report."""

    cache: VertexCache
    report: SimulationReport


def simulate_cloth(scene: Scene, clip: Clip, node: int, pinned: Bools, options: ClothOptions) -> ClothRun:
    """Return the cloth of a mesh over a clip.

    node: of the mesh instance. pinned: (V,) vertices that follow the animation; all others are simulated.
    Raises RangeError, NotFoundError for a mesh without edges or free points, UnsupportedError for more frames than the
    limit of memory allows, UnstableError with a report.
    """
    if options.solver not in SOLVERS:
        raise RangeError(f"unknown `solver` '{options.solver}' (expected {', '.join(SOLVERS)})")
    options = _with_period(options) if options.loop else options
    steps = Steps(1 / (options.fps * options.substeps), options.duration, options.warm_up)  # RangeError for too many
    baker = prepare_bake(scene, rigid=True, nodes=[node])
    template = baker.bake(Clip("", ()), times=np.zeros(1))
    start = np.concatenate([chunk.positions for chunk in template.chunks()])[0].astype(np.float64)
    model = build_cloth(start, template.faces, pinned, options.fabric, self_collision=options.self_collision)
    frame_bytes = 8 * 3 * len(model.masses) + 4 * 3 * len(start)
    steps.check_memory(f"{len(start)} vertices", fps=options.fps, frame_bytes=frame_bytes)
    followers = model.topology.first_vertex[model.pinned]
    pinned_baker = bake_vertices(scene, node, followers)
    driver = ClothDriver(baker, pinned_baker, clip, scene, options.obstacles, options.environment.period)
    substeps, frames = _simulate_under_limit(model, driver, options)
    error = None
    if options.estimate_error:
        finer = _simulate(model, driver, options, 2 * substeps)
        error = float(np.linalg.norm(finer.positions - frames.positions, axis=2).max())
        error += float(np.spacing(np.float32(np.abs(finer.positions).max())))  # of the cache's float32
    times = clip.start + np.arange(len(frames.positions), dtype=np.float64) / options.fps
    positions = frames.positions[:, model.topology.point_of_vertex].astype(np.float32)
    cache = replace(template, times=times, chunks=lambda: iter((FrameChunk(0, positions),)), rest=start)
    return ClothRun(cache, make_report(model, driver, options, substeps, frames, error))


def _with_period(options: ClothOptions) -> ClothOptions:
    """Options of a loop: whole frames, and gusts that repeat."""
    if not options.duration > 0:
        raise RangeError(f"`duration` is {options.duration:g} s (expected above 0, for a loop)")
    count = max(options.num_frames - 1, 1)
    environment = replace(options.environment, period=options.duration)
    return replace(options, fps=count / options.duration, environment=environment)


def _simulate_under_limit(model: ClothModel, driver: ClothDriver, options: ClothOptions) -> tuple[int, ClothFrames]:
    """Frames with as many substeps as `max_stretch` needs, up to MAX_SUBSTEPS."""
    substeps = options.substeps
    while options.max_stretch is not None and 2 * substeps <= MAX_SUBSTEPS:
        frames = _simulate(model, driver, options, substeps, stop_above=options.max_stretch)
        if max(each.largest for each in frames.elongations) <= options.max_stretch:
            return substeps, frames
        if frames.elongations[0].largest > options.max_stretch:
            break  # the first pose itself is stretched
        substeps *= 2
    return substeps, _simulate(model, driver, options, substeps)


def _simulate(
    model: ClothModel, driver: ClothDriver, options: ClothOptions, substeps: int, stop_above: float = np.inf
) -> ClothFrames:
    """All frames; without a loop, only those up to the first with an edge that is longer than `stop_above`."""
    positions: list[Floats] = []
    energies: list[float] = []
    num_done, record = 0, ElongationRecord()

    def counted() -> Iterator[tuple[Floats, float]]:
        nonlocal num_done
        for frame in _frames(model, driver, options, substeps, record):
            num_done += 1
            yield frame

    try:
        if options.loop:
            return _loop(model, options, counted(), record)
        for x, energy in counted():
            positions.append(x)
            energies.append(energy)
            if record.frames[-1].largest > stop_above:
                break
    except UnstableError as error:
        found = make_failed_report(model, driver, options, substeps, num_done)
        raise error.with_report(found).advise(found.advice) from None
    return ClothFrames(np.array(positions), np.array(energies), record.frames)


def _loop(
    model: ClothModel, options: ClothOptions, frames: Iterator[tuple[Floats, float]], record: ElongationRecord
) -> ClothFrames:
    """One round, closed, with the elongations of its steps and of its frames, which are blended at the seam."""
    positions, energies, seam = close_loop(frames, options.num_frames, options.fps)
    steps = [record.frames[row] for row in loop_rows(seam.first, options.num_frames - 1)]
    blended = [measure_elongation(model, x) for x in positions]
    return ClothFrames(
        positions, energies, [join_elongations(*each) for each in zip(steps, blended, strict=True)], seam
    )


def _frames(
    model: ClothModel, driver: ClothDriver, options: ClothOptions, substeps: int, record: ElongationRecord
) -> Iterator[tuple[Floats, float]]:
    """Positions (P, 3) and energy of each frame; for a loop, of all rounds."""
    rounds = MAX_ROUNDS if options.loop else 1
    timing: dict[str, Any] = {
        "fps": options.fps,
        "num_frames": rounds * (options.num_frames - 1) + 1,
        "substeps": substeps,
        "record": record,
        "warm_up_frames": round(options.warm_up * options.fps),
    }
    return run_solver(model, driver, options, **timing)
