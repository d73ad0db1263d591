"""Baking against usd-core's UsdSkel.BakeSkinning, and the whole program on a real file.

    python -m tests.benchmarks.skinning [small] [medium] [large] [long] [knight]

Ours is `anim.skinning.bake` from clip to chunks of positions, sampling and hierarchy included, chunks let go of as a
writer would; "kept" puts them into one array. USD's is BakeSkinning alone on a stage in memory, its skeleton flat.
The limit is the time of writing an array as large as the output, by all cores. They take turns in one process, in an
order that changes, and each ratio is the median of the rounds', so that a busy machine slows all alike; milliseconds
are the least of the rounds.
Memory is the peak of a process of its own for each, without what only this file imports.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.model import Clip, Interpolation, Mesh, MeshInstance, Scene, Skeleton, Skin, TimeAxis, Track
from anim.sampling import sample_pose, world_matrices

SIZES = {
    "small": (3_000, 30, 60),
    "medium": (20_000, 80, 300),
    "large": (100_000, 150, 600),
}  # vertices, joints, frames
FPS = 30.0
INFLUENCES = 4
LONG = (100_000, 150, 10_000)  # for memory alone, streamed once
ROUNDS = {"small": 20, "medium": 15, "large": 5}
METHODS = ("lbs", "dqs")


def rig(vertices: int, joints: int, frames: int) -> tuple[Scene, Clip, Floats]:
    """Return a tree of joints under a mesh whose neighboring vertices hang on neighboring joints; 1 to 4 influences."""
    random = np.random.default_rng(7)
    parents = np.array([-1, *(int(random.integers(max(0, j - 4), j)) for j in range(1, joints))])
    offsets = random.normal(size=(joints, 3)) * 0.1
    still = np.tile([0.0, 0, 0, 1], (joints, 1))
    skeleton = Skeleton(tuple(f"j{j}" for j in range(joints)), parents, offsets, still, np.ones((joints, 3)))
    world = world_matrices(skeleton, sample_pose(skeleton, Clip("", ()), np.zeros(1)))[0]
    inverse = np.concatenate([world[:, :, :3].transpose(0, 2, 1), -world[:, :, 3:]], axis=2)  # no rotation at rest
    middle = np.arange(vertices) * joints // vertices
    near = (middle[:, None] + random.integers(0, 6, (vertices, INFLUENCES))) % joints
    weights = random.random((vertices, INFLUENCES)) + 0.05
    weights[np.arange(INFLUENCES) >= random.integers(1, INFLUENCES + 1, vertices)[:, None]] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    points = world[middle, :, 3] + random.normal(size=(vertices, 3)) * 0.05
    faces = np.arange(vertices // 3 * 3).reshape(-1, 3)
    mesh = Mesh("mesh", points, faces, near, weights, np.empty((0, vertices, 3)), np.empty(0))
    axis = TimeAxis(np.arange(frames) / FPS)  # shared by all tracks, as in a file
    tracks = []
    for j in range(joints):
        half = 0.4 * np.sin(axis.times[:, None] * random.uniform(1, 4) + random.uniform(0, 6, 3)) / 2
        q = np.concatenate([half, np.sqrt(1 - (half * half).sum(axis=1, keepdims=True))], axis=1)
        tracks.append(Track(j, "rotation", Interpolation.LINEAR, axis, q))
    scene = Scene(skeleton, (MeshInstance(0, mesh, Skin(np.arange(joints), inverse), np.empty(0)),))
    return scene, Clip("clip", tuple(tracks)), axis.times


def turns(size: str, method: str) -> dict[str, list[float]]:
    """Return the seconds of each round of ours, kept, the limit and USD."""
    scene, clip, times = rig(*SIZES[size])
    jobs: dict[str, Callable[[], float]] = {
        "ours": partial(_seconds, _streamed(scene, clip, times, method)),
        "limit": partial(_seconds, _limit(size)),
        "kept": partial(_seconds, _into_one(scene, clip, times, method)),
        "usd": partial(_usd, scene, clip, times, method),
    }
    found: dict[str, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    random = np.random.default_rng(7)
    for _ in range(ROUNDS[size]):
        for name in random.permutation(list(jobs)).tolist():  # whoever follows USD finds the caches full of its data
            found[name].append(jobs[name]())
    return found


def peak(size: str, method: str, who: str) -> float:
    """Return the MB that one bake takes, the rig of the test included."""
    scene, clip, times = rig(*SIZES[size])
    if who == "usd":
        _usd(scene, clip, times, method)
    else:
        _streamed(scene, clip, times, method)()
    return _peak()


def long(method: str) -> dict[str, float]:
    """Return seconds and MB of one stream over very many frames."""
    scene, clip, times = rig(*LONG)
    return {"seconds": _seconds(_streamed(scene, clip, times, method)), "mb": _peak()}


def _streamed(scene: Scene, clip: Clip, times: Floats, method: str) -> Callable[[], None]:
    from anim.skinning.bake import prepare_bake

    made = prepare_bake(scene, method=method)

    def job() -> None:
        for _ in made.bake(clip, times=times).chunks():
            pass

    return job


def _into_one(scene: Scene, clip: Clip, times: Floats, method: str) -> Callable[[], None]:
    from anim.skinning.bake import prepare_bake

    made = prepare_bake(scene, method=method)

    def job() -> None:
        cache = made.bake(clip, times=times)
        whole = np.empty((cache.frame_count, cache.vertex_count, 3), np.float32)
        for chunk in cache.chunks():
            whole[chunk.first : chunk.first + len(chunk.positions)] = chunk.positions

    return job


def _limit(size: str) -> Callable[[], None]:
    """What writes an array of the output's size that is there already, by all cores."""
    import numba

    @numba.njit(parallel=True)  # type: ignore[untyped-decorator]
    def fill(array: Any, value: Any) -> None:
        for i in numba.prange(len(array)):
            array[i] = value

    vertices, _, frames = SIZES[size]
    array = np.empty(vertices * frames * 3, np.float32)
    return lambda: fill(array, np.float32(1))


def _usd(scene: Scene, clip: Clip, times: Floats, method: str) -> float:
    from pxr import UsdSkel

    stage, root = _stage(scene, clip, times, method)
    began = time.perf_counter()
    assert UsdSkel.BakeSkinning(root)
    seconds = time.perf_counter() - began
    del stage, root
    return seconds


def _stage(scene: Scene, clip: Clip, times: Floats, method: str) -> tuple[Any, Any]:
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

    stage = Usd.Stage.CreateInMemory()
    stage.SetTimeCodesPerSecond(FPS)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(times) - 1)
    root = UsdSkel.Root.Define(stage, "/root")
    (instance,) = scene.instances
    assert instance.skin is not None
    names = Vt.TokenArray([f"j{j}" for j in range(len(scene.skeleton))])
    skeleton = UsdSkel.Skeleton.Define(stage, "/root/skeleton")
    skeleton.CreateJointsAttr(names)
    bind = np.tile(np.eye(4), (len(names), 1, 1))
    bind[:, :3, 3] = -instance.skin.inverse_bind[:, :, 3]
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(bind.transpose(0, 2, 1))))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(bind.transpose(0, 2, 1))))
    animation = UsdSkel.Animation.Define(stage, "/root/skeleton/animation")
    animation.CreateJointsAttr(names)
    world = world_matrices(scene.skeleton, sample_pose(scene.skeleton, clip, times))
    four = np.tile(np.eye(4), (*world.shape[:2], 1, 1))
    four[:, :, :3] = world
    moves = [animation.CreateTranslationsAttr(), animation.CreateRotationsAttr(), animation.CreateScalesAttr()]
    for f in range(len(times)):
        matrices = Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(four[f].transpose(0, 2, 1)))
        for attribute, values in zip(moves, UsdSkel.DecomposeTransforms(matrices), strict=True):
            attribute.Set(values, f)
    mesh = UsdGeom.Mesh.Define(stage, "/root/mesh")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(instance.mesh.positions.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(instance.mesh.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(instance.mesh.faces.astype(np.int32).ravel()))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    joints = Vt.IntArray.FromNumpy(instance.mesh.joints.astype(np.int32).ravel())
    binding.CreateJointIndicesPrimvar(False, INFLUENCES).Set(joints)
    weights = Vt.FloatArray.FromNumpy(instance.mesh.weights.astype(np.float32).ravel())
    binding.CreateJointWeightsPrimvar(False, INFLUENCES).Set(weights)
    binding.CreateSkeletonRel().SetTargets([Sdf.Path("/root/skeleton")])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
    kind = "classicLinear" if method == "lbs" else "dualQuaternion"
    binding.CreateSkinningMethodAttr().Set(kind)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    return stage, root


def knight(folder: str, *, cold: bool) -> dict[str, float]:
    """Return seconds and MB of `bake Knight.glb --method dqs` for all its clips, as a process. cold: compile too."""
    from tests.files import ASSETS

    environment = dict(os.environ)
    if cold:
        environment["NUMBA_CACHE_DIR"] = tempfile.mkdtemp(dir=folder)
    command = [Path(sys.executable).parent / "gltf-anim", "bake", ASSETS / "Knight.glb", f"{folder}/{{clip}}.npz"]
    seconds = []
    for _ in range(1 if cold else 3):
        began = time.perf_counter()
        subprocess.run([*map(str, command), "--method", "dqs", "-q"], env=environment, check=True)
        seconds.append(time.perf_counter() - began)
    return {"seconds": min(seconds), "mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1000}


def _seconds(job: Callable[[], None]) -> float:
    began = time.perf_counter()
    job()
    return time.perf_counter() - began


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000


def _measured(*call: str) -> Any:
    """The result of one measurement in a process of its own."""
    run = subprocess.run([sys.executable, "-m", __spec__.name, "--one", *call], capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(run.stderr)
    return json.loads(run.stdout)


def _one(call: list[str]) -> Any:
    kind, *rest = call
    if kind == "knight":
        return knight(rest[0], cold=rest[1] == "cold")
    jobs: dict[str, Callable[..., Any]] = {"turns": turns, "peak": peak, "long": long}
    return jobs[kind](*rest)


def _row(size: str, method: str) -> str:
    found = {name: np.array(values) for name, values in _measured("turns", size, method).items()}
    ours, theirs = (_measured("peak", size, method, who) for who in ("ours", "usd"))
    least = {name: 1e3 * values.min() for name, values in found.items()}
    share, faster = np.median(found["ours"] / found["limit"]), np.median(found["usd"] / found["ours"])
    return (
        f"  {method}  {least['ours']:8.1f} ms ({share:4.1f}x the limit of {least['limit']:.1f} ms), "
        f"kept {least['kept']:8.1f} ms, {ours:5.0f} MB;  usd-core {least['usd']:8.1f} ms, {theirs:5.0f} MB;  "
        f"{faster:4.1f}x faster, {ours / theirs:.2f} of the memory\n"
    )


def main(arguments: list[str]) -> None:
    """Write a table for each size that is asked for, or all."""
    if arguments[:1] == ["--one"]:
        sys.stdout.write(json.dumps(_one(arguments[1:])))
        return
    wanted = arguments or [*SIZES, "long", "knight"]
    for size in (each for each in SIZES if each in wanted):
        vertices, joints, frames = SIZES[size]
        output = 12 * vertices * frames / 1e6
        sys.stdout.write(f"\n{size}: {vertices} vertices x {joints} joints x {frames} frames, {output:.0f} MB\n")
        for method in METHODS:
            sys.stdout.write(_row(size, method))
            sys.stdout.flush()
    if "long" in wanted:
        one = _measured("long", "dqs")
        sys.stdout.write(f"\nlong: 100000 vertices x 10000 frames, dqs: {one['seconds']:.1f} s, {one['mb']:.0f} MB\n")
    if "knight" in wanted:
        with tempfile.TemporaryDirectory() as folder:
            cold, warm = (_measured("knight", folder, kind) for kind in ("cold", "warm"))
        sys.stdout.write(
            f"\nbake Knight.glb --method dqs, 76 clips: {cold['seconds']:.1f} s with compiling, "
            f"{warm['seconds']:.1f} s after, {warm['mb']:.0f} MB\n"
        )


if __name__ == "__main__":
    main(sys.argv[1:])
