"""Document + bodies → document with a clip in which they fall, collide and come to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.gltf.authoring import add_clips
from anim.gltf.document import Document
from anim.gltf.writing.writer import replace_clips
from anim.model import Clip, Scene, Skeleton, Track
from anim.sampling.pose import sample_pose
from anim.sampling.world import world_matrices
from anim.simulation.particles.forces import EARTH_GRAVITY_M_S2
from anim.simulation.report import SimulationReport
from anim.simulation.rigid_bodies import tracks
from anim.simulation.rigid_bodies.assembly import assemble
from anim.simulation.rigid_bodies.description import PhysicsDescription, Vector
from anim.simulation.rigid_bodies.khr_reader import read_khr
from anim.simulation.rigid_bodies.motion import RigidMotion, run_scene
from anim.simulation.rigid_bodies.notes import find_notes
from anim.simulation.rigid_bodies.omi_reader import read_omi
from anim.simulation.rigid_bodies.rigid_scene import BodyKind, RigidScene
from anim.simulation.steps import Steps


@dataclass(frozen=True, slots=True)
class RigidOptions:
    """Gravity and time of a run. step: s, the longest; it is shortened so that it divides a frame.

    max_error: m, of any point of a body's colliders, within which keys are removed; 0 for none.
    estimate_error: run again with half the step, which takes twice as long.
    """

    gravity: Vector = EARTH_GRAVITY_M_S2
    step: float = 1 / 240
    fps: float = 60.0
    duration: float = 5.0
    warm_up: float = 0.0
    max_error: float = 0.0
    estimate_error: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class RigidRun:
    """Result of a run. notes: remarks for the user."""

    tracks: list[Track]
    report: SimulationReport
    notes: list[str]


def read_description(document: Document, skeleton: Skeleton) -> PhysicsDescription:
    """Return the bodies of KHR_physics_rigid_bodies, or else of OMI_physics_body."""
    found = read_khr(document, skeleton)
    return found if found.motions or found.colliders else read_omi(document, skeleton)


def simulate_rigid_bodies(scene: Scene, clip: Clip, description: PhysicsDescription, options: RigidOptions) -> RigidRun:
    """Return the tracks of all bodies. Raises UnstableError for a run that diverges, RangeError without a body."""
    skeleton = scene.skeleton
    substeps = max(1, int(np.ceil(1 / (options.fps * options.step) - 1e-9)))
    steps = Steps(1 / (options.fps * substeps), options.duration, options.warm_up)
    world = world_matrices(skeleton, sample_pose(skeleton, clip, np.zeros(1)))[0]
    rigid = assemble(description, skeleton, clip, world, options.gravity)
    motion = run_scene(rigid, skeleton, clip, steps, substeps=substeps)
    finer = Steps(steps.step_s / 2, steps.num_steps * steps.step_s, options.warm_up)
    other = run_scene(rigid, skeleton, clip, finer, substeps=2 * substeps, stride=2)
    frames = steps.frames(options.fps)
    worlds = tracks.WorldAtTimes(skeleton, clip, world, rigid, motion)
    made = tracks.make_tracks(skeleton, rigid, motion, frames, worlds, options.max_error)
    error = float(np.linalg.norm(motion.positions - other.positions, axis=-1).max())
    report = _report(rigid, motion, made, options, steps, error)
    return RigidRun(made.tracks, report, find_notes(rigid, skeleton, clip, motion, made.shear))


def add_rigid_motion(document: Document, run: RigidRun, name: str, merge: tuple[int, Clip] | None = None) -> Document:
    """Return the document with a clip of the bodies' tracks. merge: index and clip that gets them instead."""
    if merge is not None:
        number, clip = merge
        return replace_clips(
            document, {number: Clip(clip.name, (*tracks.drop_replaced(clip, run.tracks), *run.tracks))}
        )
    return add_clips(document, [Clip(name, tuple(run.tracks))])


def _report(
    rigid: RigidScene, motion: RigidMotion, made: tracks.BodyTracks, options: RigidOptions, steps: Steps, error: float
) -> SimulationReport:
    speeds = _speeds(motion)
    kinds = [body.kind for body in rigid.bodies]
    figures = {
        "bodies": len(rigid.moving),
        "static": kinds.count(BodyKind.STATIC),
        "animated": kinds.count(BodyKind.ANIMATED),
        "joints": len(rigid.joints),
        "impacts": made.num_impacts,
        "keys": sum(len(track.times) for track in made.tracks),
        "at_rest": int((np.abs(motion.positions[-1] - motion.positions[-2:][0]).max(axis=-1) == 0).sum()),
        "max_speed_m_s": float(speeds.max(initial=0.0)),
        "max_step_m": float(speeds.max(initial=0.0)) * steps.step_s,
    }
    return SimulationReport(
        "rigid",
        steps.step_s,
        steps.num_steps,
        options.fps,
        options.duration,
        warm_up_s=options.warm_up,
        energy_j=_energy(motion.energies),
        penetration_m=max(0.0, motion.penetration),
        error_estimate_m=error,
        figures=figures,
    )


def _energy(energies: Floats) -> dict[str, float] | None:
    """Total energy above that of the lowest position; None for a run without a step."""
    if not len(energies):
        return None
    total = energies.sum(axis=1) - energies[:, 1].min()
    return {"start": float(total[0]), "end": float(total[-1]), "peak": float(total.max())}


def _speeds(motion: RigidMotion) -> Floats:
    if len(motion.times) < 2:
        return np.zeros(0)
    return np.asarray(np.linalg.norm(np.diff(motion.positions, axis=0), axis=-1) / motion.times[1])
