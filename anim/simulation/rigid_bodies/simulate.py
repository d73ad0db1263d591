"""Document + bodies → document with a clip in which they fall, collide and come to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError, UnstableError
from anim.gltf.authoring import add_clips
from anim.gltf.document import Document
from anim.gltf.writing.writer import replace_clips
from anim.maths import quaternion
from anim.model import Clip, Scene, Skeleton, Track
from anim.operations.retime import shift_time
from anim.sampling.pose import sample_pose
from anim.sampling.world import world_matrices
from anim.simulation.report import SimulationReport
from anim.simulation.rigid_bodies import distances, tracks
from anim.simulation.rigid_bodies.assembly import assemble
from anim.simulation.rigid_bodies.description import PhysicsDescription
from anim.simulation.rigid_bodies.khr_reader import read_khr
from anim.simulation.rigid_bodies.loop import close_loop
from anim.simulation.rigid_bodies.motion import Recorder, RigidMotion, run_scene
from anim.simulation.rigid_bodies.notes import find_notes
from anim.simulation.rigid_bodies.omi_reader import read_omi
from anim.simulation.rigid_bodies.options import RigidOptions
from anim.simulation.rigid_bodies.overlaps import check_overlaps
from anim.simulation.rigid_bodies.report import make_report
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from anim.simulation.steps import Steps, count_substeps

STEP_BYTES, FRAME_BYTES = 200, 300  # of a body at each step and frame, while they become keys
MAX_ROUNDS = 20  # of the clip, until bodies repeat their motion


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
    """Return the tracks of all bodies, from the start of the clip on.

    Raises UnstableError with a report for a run that diverges, RangeError without a body, or for a loop of bodies that
    nothing moves again, UnsupportedError for more steps than the limit of memory allows, or bodies in each other or
    too far apart.
    """
    skeleton, start = scene.skeleton, clip.start
    clip = Clip(clip.name, tuple(shift_time(track, -start) for track in clip.tracks))
    substeps = count_substeps(options.fps, options.step)
    steps = Steps(1 / (options.fps * substeps), options.duration, options.warm_up)
    world = world_matrices(skeleton, sample_pose(skeleton, clip, np.zeros(1)))[0]
    rigid = assemble(description, skeleton, clip, world, options.gravity)
    if options.loop and not rigid.can_repeat:
        raise RangeError(
            "`loop` needs a clip or motor that moves bodies: those that only fall don't come back",
            help=("leave it out: players repeat any clip"),
        )
    distances.check_start(rigid, skeleton)
    check_overlaps(rigid)
    rounds = MAX_ROUNDS if options.loop else 1
    count = len(rigid.moving)
    sizes = {"step_bytes": STEP_BYTES * count, "frame_bytes": FRAME_BYTES * count}
    steps.check_memory(f"{count} moving bodies", fps=options.fps, **sizes)
    try:
        motion = run_scene(rigid, skeleton, clip, steps, substeps=substeps, max_rounds=rounds)
        errors = _step_errors(rigid, skeleton, clip, motion, steps, options, substeps)
    except UnstableError as error:
        recorder = error.report
        assert isinstance(recorder, Recorder)
        run = Steps(recorder.step_s, options.duration, options.warm_up)  # this one, or that with half the step
        found = make_report(rigid, recorder.motion(), options, run, first_bad_step=recorder.num_states)
        raise error.with_report(found) from None
    seam = None
    if options.loop:
        motion, seam = close_loop(motion, options.duration)
    frames = steps.frames(options.fps)
    worlds = tracks.WorldAtTimes(skeleton, clip, world, rigid, motion)
    made = tracks.make_tracks(skeleton, rigid, motion, frames, worlds, start=start, max_error=options.max_error)
    report = make_report(rigid, motion, options, steps, errors=errors, made=made, seam=seam)
    return RigidRun(made.tracks, report, find_notes(rigid, skeleton, clip, motion, made.shear, seam or 0.0))


def _step_errors(
    rigid: RigidScene,
    skeleton: Skeleton,
    clip: Clip,
    motion: RigidMotion,
    steps: Steps,
    options: RigidOptions,
    substeps: int,
) -> Floats:
    """Largest distance (S,) of a body's points from the same run with half the step; empty unless asked for.

    A body's rotation counts at the radius of its colliders.
    """
    if not options.estimate_error:
        return np.empty(0)
    half = Steps(steps.step_s / 2, steps.num_steps * steps.step_s, options.warm_up)
    other = run_scene(
        rigid, skeleton, clip, half, substeps=2 * substeps, finds_impacts=False, max_rounds=motion.num_rounds
    )
    apart = np.linalg.norm(motion.positions - other.positions[::2], axis=-1)
    angle = quaternion.angle_between(motion.rotations, other.rotations[::2])
    radii = np.array([rigid.bodies[i].radius for i in rigid.moving])
    return np.asarray((apart + 2 * radii * np.sin(angle / 2)).max(axis=1, initial=0.0))


def add_rigid_motion(document: Document, run: RigidRun, name: str, merge: tuple[int, Clip] | None = None) -> Document:
    """Return the document with a clip of the bodies' tracks. merge: index and clip that gets them instead."""
    if merge is not None:
        number, clip = merge
        return replace_clips(
            document, {number: Clip(clip.name, (*tracks.drop_replaced(clip, run.tracks), *run.tracks))}
        )
    return add_clips(document, [Clip(name, tuple(run.tracks))])
