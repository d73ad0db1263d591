"""Clip + Scene → VertexCache: every vertex at every frame, a chunk of frames at a time."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate

import numpy as np

from anim import arrays
from anim.arrays import Floats, Ints
from anim.errors import NotFoundError, RangeError, ShapeError, UnsupportedError, check_number, check_type
from anim.model import Clip, MeshInstance, MeshPart, PrimitiveRange, Scene, VertexCache
from anim.sampling.pose import PosedSkeleton
from anim.skinning.binding import SkinBinding
from anim.skinning.bound_mesh import BoundMesh, Make, bind_mesh
from anim.skinning.chunk_pipeline import ChunkPipeline, count_frame_bytes
from anim.skinning.methods.blended import BlendedMethod
from anim.skinning.methods.bulge_clamp import BulgeClamp
from anim.skinning.methods.linear_blend import LinearBlend
from anim.skinning.methods.registry import SKINNING_METHODS
from anim.skinning.methods.skinner import Skinner
from anim.skinning.small_meshes import NO_NODE, merge_small_meshes

SPACES = ("world", "mesh")
REVERSED = [0, 2, 1]  # corners of a face with the other winding


def bake(
    scene: Scene,
    clip: Clip,
    *,
    times: Floats,
    method: str = "lbs",
    blend: float | None = None,
    bulge_clamp: bool = False,
    space: str = "world",
    normals: bool = False,
    tangents: bool = False,
    rigid: bool = False,
    nodes: Sequence[int] | None = None,
    threads: int | None = None,
    progress: Callable[[int], None] = lambda frames: None,
) -> VertexCache:
    """Return the vertices of a scene at `times` (F,) in seconds of a clip.

    Parameters as for `prepare_bake`, which suits many clips better; progress: called with the number of frames done.
    bake(scene, clip, times=grid(0, 1, fps=30), method="dqs") → VertexCache of 31 frames
    """
    made = prepare_bake(
        scene,
        method=method,
        blend=blend,
        bulge_clamp=bulge_clamp,
        space=space,
        normals=normals,
        tangents=tangents,
        rigid=rigid,
        nodes=nodes,
        threads=threads,
    )
    return made.bake(clip, times=times, progress=progress)


def prepare_bake(
    scene: Scene,
    *,
    method: str = "lbs",
    blend: float | None = None,
    bulge_clamp: bool = False,
    space: str = "world",
    normals: bool = False,
    tangents: bool = False,
    rigid: bool = False,
    nodes: Sequence[int] | None = None,
    threads: int | None = None,
) -> Baker:
    """Return a baker for clips of a scene; data of the meshes is prepared once.

    method: one of SKINNING_METHODS. blend: fraction of the method, the rest is lbs; None for all of it. bulge_clamp:
    pull vertices back that are farther from their bone than at rest, weighted by their blend of two joints. space:
    "world", where a skinned mesh's own node doesn't count, or "mesh", the space of the mesh's node. normals: bake unit
    normals too; of a mesh without them, those of its faces' mean. tangents: unit tangents too, with the handedness in
    the file; all meshes must have them. rigid: meshes without skin and morph targets, too. nodes: only meshes on these.
    threads: None for one per core; the result doesn't depend on it. Raises RangeError for a parameter out of its range,
    NotFoundError if nothing is left to bake, UnsupportedError for tangents of a mesh without any, or for joints beyond
    the limit of memory.
    """
    check_type(scene, Scene, "scene", help="anim.bake takes an asset")
    _check_indices(nodes, threads)
    blend = _check(method, blend, space, bulge_clamp=bulge_clamp)
    chosen = bakeable_instances(scene, rigid=rigid, nodes=nodes)
    if not chosen:
        raise NotFoundError("there is no mesh with a skin or morph targets to bake", help=_hint(scene, rigid=rigid))
    rest = PosedSkeleton.at_rest(scene.skeleton)
    bind = partial(bind_mesh, scene.skeleton, space=space, normals=normals, tangents=tangents)
    make = _maker(method, blend, bulge_clamp=bulge_clamp)
    if space == "mesh":  # each in the space of its own node
        merged: Sequence[MeshInstance] = chosen
    else:
        chosen = _wound_as_shown(chosen, rest)
        merged = merge_small_meshes(chosen, scene.skeleton, skinned=method == "lbs")
    bound = _bind_all(bind, merged, make)
    count_frame_bytes(scene.skeleton, bound)  # refuses too many joints before any is posed
    return Baker(
        scene,
        tuple(chosen),
        bound,
        lambda: bound if len(bound) == len(chosen) else _bind_all(bind, chosen, make),
        sum(len(each.rig.points) for each in bound),
        np.concatenate([each.rig.faces + each.at for each in bound]),
        tuple(_parts(scene, chosen)),
        np.concatenate([each.at_rest(rest) for each in bound]),
        normals,
        _handedness(chosen) if tangents else None,
        threads or _cpu_count(),
    )


@dataclass(frozen=True, slots=True)
class Baker:
    """Meshes of a scene, ready to be baked with any clip.

    instances: in the order of their vertices, of which `vertices` is the number. bound: the same, small ones as one.
    bind_each: returns the layer of each instance. faces: (T, 3) of all of them.
    rest: (V, 3) m, vertices in the scene's rest pose. normals: whether they are baked too. handedness: (V,)
    of tangents, None without them.
    """

    scene: Scene
    instances: tuple[MeshInstance, ...]
    bound: tuple[BoundMesh, ...]
    bind_each: Callable[[], tuple[BoundMesh, ...]]
    vertices: int
    faces: Ints
    parts: tuple[MeshPart, ...]
    rest: Floats
    normals: bool
    handedness: Floats | None
    threads: int

    def bake(self, clip: Clip, *, times: Floats, progress: Callable[[int], None] = lambda frames: None) -> VertexCache:
        """Return the vertices at `times` (F,) in seconds of a clip.

        Vertices come in the scene's order: nodes depth-first, primitives as in the file, vertices as in their accessor.
        Frames are computed on iteration, a chunk at a time: memory doesn't grow with F.
        progress: called with the number of frames done, after each chunk.
        """
        check_type(clip, Clip, "clip")
        seconds = arrays.as_key_times(times)
        wanted = (self.normals, self.handedness is not None)
        stream = ChunkPipeline(self.scene.skeleton, self.bound, self.vertices, *wanted, self.threads)
        return VertexCache(
            seconds,
            self.vertices,
            self.faces,
            lambda: stream.chunks(clip, seconds, progress),
            rest=self.rest,
            has_normals=self.normals,
            parts=self.parts,
            handedness=self.handedness,
        )


def bakeable_instances(scene: Scene, *, rigid: bool = False, nodes: Sequence[int] | None = None) -> list[MeshInstance]:
    """Return the mesh instances with vertices to bake: skinned or morphed ones, all with `rigid`."""
    chosen = None if nodes is None else frozenset(nodes)
    return [
        instance
        for instance in scene.instances
        if len(instance.mesh.positions)
        and (rigid or instance.skin is not None or len(instance.mesh.targets))
        and (chosen is None or instance.node in chosen)
    ]


def left_out_nodes(scene: Scene, *, rigid: bool = False, nodes: Sequence[int] | None = None) -> frozenset[int]:
    """Return the nodes with meshes that a bake of some nodes leaves out; none if `nodes` is None."""
    if nodes is None:
        return frozenset()
    baked = {each.node for each in bakeable_instances(scene, rigid=rigid, nodes=nodes)}
    return frozenset({each.node for each in scene.instances} - baked)


def _handedness(chosen: Sequence[MeshInstance]) -> Floats:
    """The signs (V,) for the bitangent of normal and tangent; a mirrored joint does not change them.

    Players use them in this manner (three.js: unchanged TANGENT.w).
    """
    signs = []
    for instance in chosen:
        if instance.mesh.tangents is None:
            name = instance.mesh.name or f"node {instance.node}"
            raise UnsupportedError(
                f"mesh '{name}' has no tangents", help="`normals` are computed where a file has none"
            )
        signs.append(instance.mesh.tangents[:, 3])
    return np.concatenate(signs)


def _maker(method: str, blend: float | None, *, bulge_clamp: bool) -> Make:
    """Factory of the skinner of a rig; all methods are equal on a mesh with a single joint."""

    def make(rig: SkinBinding, plain: bool) -> Skinner:
        if len(rig.nodes) == 1:
            return LinearBlend(rig, plain)
        skinner = SKINNING_METHODS[method].skinner(rig, plain)
        if bulge_clamp:
            skinner = BulgeClamp(skinner, rig)
        return skinner if blend is None else BlendedMethod(LinearBlend(rig, plain), skinner, blend)

    return make


def _check(method: str, blend: float | None, space: str, *, bulge_clamp: bool) -> float | None:
    """Return `blend` as a float. Raises RangeError for what is not one of the known, ShapeError for another type."""
    if method not in SKINNING_METHODS:
        raise RangeError(f"`method` is '{method}' (expected one of {', '.join(SKINNING_METHODS)})")
    if blend is not None:
        blend = check_number(blend, "blend")
    if blend is not None and not 0 <= blend <= 1:
        raise RangeError(f"`blend` is {blend:g} (expected 0 … 1)")
    if method == "lbs" and (blend is not None or bulge_clamp):
        what = "blend" if blend is not None else "bulge_clamp"
        raise RangeError(f"`{what}` requires a method other than lbs (expected dqs or cor)")
    if space not in SPACES:
        raise RangeError(f"`space` is '{space}' (expected one of {', '.join(SPACES)})")
    return blend


def _check_indices(nodes: Sequence[int] | None, threads: int | None) -> None:
    if isinstance(nodes, str) or not all(isinstance(node, int | np.integer) for node in nodes or ()):
        raise ShapeError(f"nodes is {nodes!r} (expected indices)", help="anim.bake takes names as `meshes`")
    if threads is not None and threads < 0:
        raise RangeError(f"`threads` is {threads} (expected 1 or more, or None)")


def _hint(scene: Scene, *, rigid: bool) -> str:
    if not any(len(instance.mesh.positions) for instance in scene.instances):
        return "the file has no mesh with vertices"
    return "" if rigid else "unskinned meshes are baked with `rigid`"


def _bind_all(bind: Callable[..., BoundMesh], instances: Sequence[MeshInstance], make: Make) -> tuple[BoundMesh, ...]:
    starts = accumulate((len(each.mesh.positions) for each in instances), initial=0)
    linear = LinearBlend  # of several meshes, as they are all blended so
    return tuple(
        bind(each, linear if each.node == NO_NODE else make, at) for each, at in zip(instances, starts, strict=False)
    )


def _wound_as_shown(instances: Sequence[MeshInstance], rest: PosedSkeleton) -> list[MeshInstance]:
    """The instances, with reversed faces where the node mirrors them at rest: players do so."""
    mirrored = np.linalg.det(rest.world[[each.node for each in instances], 0, :, :3]) < 0
    return [
        replace(each, mesh=replace(each.mesh, faces=np.ascontiguousarray(each.mesh.faces[:, REVERSED])))
        if is_mirrored
        else each
        for each, is_mirrored in zip(instances, mirrored.tolist(), strict=True)
    ]


def _parts(scene: Scene, instances: Sequence[MeshInstance]) -> Iterator[MeshPart]:
    vertex = face = 0
    for each in instances:
        mesh = each.mesh
        name = mesh.name or scene.skeleton.names[each.node]
        primitives = mesh.stored_primitives or (PrimitiveRange(len(mesh.positions), len(mesh.faces)),)
        for primitive in primitives:
            ends = vertex + primitive.vertices, face + primitive.faces
            if primitive.vertices:
                yield MeshPart(name, (vertex, ends[0]), (face, ends[1]), each.node, primitive.material)
            vertex, face = ends


def _cpu_count() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
