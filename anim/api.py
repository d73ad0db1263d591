"""Functions of the facade `anim`, on assets and names of clips.

Lengths as text have units, as on the command line: "0.5mm", "2cm", "0.1%" of the diagonal of the model's bounding box;
numbers are metres.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, fields, replace
from typing import TypeAlias

from numpy.typing import ArrayLike

from anim.arguments import (
    Length,
    check_choice,
    check_flags,
    check_function,
    check_workers,
    glob_list,
    meters,
    num_bytes,
    radians,
)
from anim.arrays import Floats, as_times
from anim.asset import Asset, AssetLike, PathName, as_asset, copy_asset
from anim.baked_cache import BakedCache, BakeOrigin
from anim.errors import AnimError, RangeError
from anim.gltf.document import Document, copy_json
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.measure.compare import diff as compare
from anim.measure.compare.diff import Diff
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import FPS
from anim.measure.error.surface import diagonal, reference_length
from anim.model import Clip
from anim.operations.selection import Selection, match_names
from anim.optimization.byte_limit import ByteLimit
from anim.optimization.file_optimizer import FileOptimizer
from anim.optimization.optimize import Optimized
from anim.optimization.options import DEFAULT_MAX_ERROR, EFFORTS, Bounds, Drop, Packing, Policy, Request
from anim.sampling.sample import PoseTable
from anim.sampling.sample import sample as sample_table
from anim.sampling.times import frame_times
from anim.skinning import bake as skinning

ClipKey: TypeAlias = Clip | str | int
SHELL = "1%"  # of the reference length: radius of the sample points around nodes without vertices
MAX_POINTER_ERROR = 1e-4  # of the range of a pointer track


@dataclass(frozen=True, slots=True)
class OptimizeResult:
    """Optimized asset with its errors.

    asset: the asset to save. max_error: m, largest displacement of any vertex in any clip, measured on the saved bytes.
    errors: the same by name of each optimized clip, in the order of the file; "#i" for clip i if an earlier clip has
    its name.
    """

    asset: Asset
    max_error: float
    errors: dict[str, float]

    def save(self, path: PathName) -> None:
        """Write the asset, as `anim.save` does."""
        self.asset.save(path)


def optimize(
    asset: AssetLike,
    *,
    max_error: Length | None = None,
    max_bytes: str | int | None = None,
    clips: str | Sequence[str] | None = None,
    max_angle: str | float | None = None,
    max_speed_error: Length | None = None,
    keep_nodes: str | Sequence[str] = (),
    drop: str = "unused",
    rebase_rest: bool = False,
    meshopt: str | None = None,
    effort: str = "balanced",
    workers: int = 1,
    progress: Callable[[float], None] | None = None,
) -> OptimizeResult:
    """Return the asset with smaller animations and no vertex displaced by more than `max_error`.

    max_error: "0.5mm", "0.01%" (the default), or metres; 0 is lossless. max_bytes: of the asset as a GLB, 800_000
    or "800kB": the smallest error that fits, up to `max_error`, by default 10 % of the diagonal; RangeError if none.
    clips: globs, all by default; an empty list is refused.
    max_angle: of any node's local rotation, "0.5deg" or radians. max_speed_error: per second, of any vertex.
    keep_nodes: globs for nodes with exact motion. drop: "rest", "unused" or "never", removed channels at the rest pose.
    meshopt: "ext" or "khr" for compression by that extension. effort: "fast", "balanced" or "max".
    progress: called with the fraction done of a search, of which `max_bytes` needs several.
    workers: processes, 0 for one per core; a script with more than one needs `if __name__ == "__main__":`.
    The result is the asset itself if nothing gets smaller.
    optimize("walk.glb", max_error="0.5mm").save("small.glb")
    """
    asset = as_asset(asset)
    document = container.check_edits(asset.document)
    asset = asset if document is asset.document else replace(asset, document=document)
    scale = diagonal(asset.scene)

    def length(value: Length, name: str) -> float:
        return meters(value, name, lambda: scale, at_least=0.0)

    usual = DEFAULT_MAX_ERROR if max_error is None else max_error
    limits = Bounds(
        length(usual, "max_error"),
        meters(SHELL, "shell", lambda: reference_length(scale)),
        MAX_POINTER_ERROR,
        None if max_angle is None else radians(max_angle, "max_angle"),
        None if max_speed_error is None else length(max_speed_error, "max_speed_error"),
    )
    nodes = glob_list(keep_nodes or None, "keep_nodes")
    kept = Selection((), nodes).chosen_nodes(asset.skeleton) if nodes else ()
    check_workers(workers)
    limit = None if max_bytes is None else num_bytes(max_bytes, "max_bytes")
    if progress is not None:
        check_function(progress, "progress", "a function of the fraction done")
    check_flags(rebase_rest=rebase_rest)
    check_choice("effort", effort, tuple(EFFORTS))
    check_choice("drop", drop, tuple(Drop))
    check_choice("meshopt", meshopt or "ext", ("ext", "khr"))
    request = Request(
        limits,
        Policy(Drop(drop), rebase_rest=rebase_rest, keep=frozenset(kept)),
        Packing.CORE if meshopt is None else Packing(meshopt),
        effort=effort,
        given=(str(usual), str(max_angle), str(max_speed_error)),
    )
    globs = glob_list(clips, "clips")
    chosen = match_names(globs, asset.clips.names, "clip")
    optimizer = FileOptimizer(
        asset.document,
        asset.scene,
        tuple(asset.clips),
        chosen=chosen,
        scale=scale,
        written_size=_glb_size,
        workers=workers or os.cpu_count() or 1,
        progress=lambda: nullcontext(progress or (lambda _: None)),
    )
    if limit is None:
        found = optimizer.run(request)
    else:
        ceiling = None if max_error is None else limits.max_error
        request, found = ByteLimit(optimizer, limit, request, ceiling).run()
    document, _ = optimizer.choose_document(found)
    if document is not asset.document:
        document = replace(document, json=copy_json(document.json))  # the caller may edit it
    return _build_result(asset, replace(asset, document=document), found, request.bounds, chosen)


def bake(
    asset: AssetLike,
    clip: ClipKey = 0,
    *,
    method: str = "lbs",
    fps: float | None = None,
    times: ArrayLike | None = None,
    blend: float | None = None,
    bulge_clamp: bool = False,
    space: str = "world",
    normals: bool = False,
    tangents: bool = False,
    rigid: bool = False,
    meshes: str | Sequence[str] | None = None,
) -> BakedCache:
    """Return a clip as a vertex cache: every vertex at every frame, skinned by `method`.

    method: "lbs", "dqs", "cor", …, a name in `anim.SKINNING_METHODS`. fps: frames per second; or times, in seconds;
    without both a frame per key. space: "world" or "mesh". normals, tangents: bake those too.
    rigid: include meshes without a skin. meshes: globs for names of meshes; by default all, of all scenes.
    Formats with materials get those of the asset; without normals=True, `save` makes lit ones normals from the faces.
    bake("walk.glb", "walk", method="dqs", fps=24).save("walk.usdc")
    """
    asset = as_asset(asset)
    check_flags(bulge_clamp=bulge_clamp, normals=normals, tangents=tangents, rigid=rigid)
    scene = (
        asset.scene
        if not (normals or tangents)
        else reader.scene(container.check_edits(asset.document), normals=True, tangents=tangents)
    )
    globs = glob_list(meshes, "meshes")
    names = [each.mesh.name or f"#{i}" for i, each in enumerate(scene.instances)]
    nodes = [scene.instances[i].node for i in match_names(globs, names, "mesh")] if globs else None
    playing = _clip(asset, clip)
    cache = skinning.bake(
        scene,
        playing,
        times=_times(playing, fps, times),
        method=method,
        blend=blend,
        bulge_clamp=bulge_clamp,
        space=space,
        normals=normals or tangents,
        tangents=tangents,
        rigid=rigid,
        nodes=nodes,
    )
    others = skinning.left_out_nodes(scene, rigid=rigid, nodes=nodes)
    index = next((i for i, each in enumerate(asset.clips) if each is playing), None)
    origin = BakeOrigin(copy_asset(asset), playing, index, others, space == "mesh", times is not None)
    return BakedCache(**{each.name: getattr(cache, each.name) for each in fields(cache)}, origin=origin)


def diff(
    old: AssetLike,
    new: AssetLike,
    *,
    clips: str | Sequence[str] | None = None,
    player: str = "spec",
    fps: float = FPS,
) -> Diff:
    """Return the distances between the motion of two assets, in metres on the surface; worst clip first.

    Its `max_error` is the largest distance of all, infinite if a clip is missing in `new`, 0 without clips in `old`.
    clips: globs for names in `old`. player: of both, or two, "spec,nlerp". fps: of the sampled grid, in addition to all
    keys.
    """
    old, new = as_asset(old), as_asset(new)
    globs = glob_list(clips, "clips")
    chosen = match_names(globs, old.clips.names, "clip") if globs else None
    before, after = tuple(old.clips), tuple(new.clips)
    metric = ErrorMetric(old.scene, new.scene, clips=before + after)
    documents = old.document.json, new.document.json
    return compare.diff(metric, before, after, chosen=chosen, player=player, fps=fps, documents=documents)


def sample(asset: AssetLike, clip: ClipKey = 0, *, fps: float | None = None, times: ArrayLike | None = None) -> Floats:
    """Return the world positions of all nodes over a clip: (F, N, 3) m.

    Columns are the nodes of `asset.skeleton`, in its order. fps: frames per second, from the clip's start to its exact
    end; or times, in seconds; without both at the clip's own keys. `sample_poses` gives rotations and times too.
    sample("walk.glb", "walk", fps=30).shape → (31, 22, 3)
    """
    return sample_poses(asset, clip, fps=fps, times=times).translation


def sample_poses(
    asset: AssetLike,
    clip: ClipKey = 0,
    *,
    fps: float | None = None,
    times: ArrayLike | None = None,
    space: str = "world",
) -> PoseTable:
    """Return the transforms of all nodes over a clip: times, translation, rotation (x, y, z, w), scale.

    space: "world", then also the matrices as `world`, or "local", in the parent's space. Else as `sample`.
    """
    asset = as_asset(asset)
    playing = _clip(asset, clip)
    return sample_table(asset.skeleton, playing, _times(playing, fps, times), space=space)


def _build_result(
    asset: Asset, smaller: Asset, found: Optimized, limits: Bounds, chosen: Sequence[int]
) -> OptimizeResult:
    bad = [i for i, each in found.verdicts.items() if not each.holds]
    if bad:
        off = found.verdicts[bad[0]].error
        label = reader.clip_label(asset.clips[bad[0]].name, bad[0])
        raise AnimError(f"{label}: {off.max_error:g} m at {off.time:g} s (bound {limits.max_error:g} m)")
    names = asset.clips.names
    errors: dict[str, float] = {}
    for i in chosen:
        error = found.verdicts[i].error.max_error if i in found.verdicts else 0.0
        errors[f"#{i}" if names[i] in errors else names[i]] = error
    if smaller.document is asset.document:
        return OptimizeResult(asset, 0.0, dict.fromkeys(errors, 0.0))
    return OptimizeResult(smaller, max(errors.values(), default=0.0), errors)


def _glb_size(document: Document) -> int:
    """Size in bytes as a GLB."""
    return sum(len(piece) for piece in container.glb(document))


def _clip(asset: Asset, key: ClipKey) -> Clip:
    return key if isinstance(key, Clip) else asset.clips[key]


def _times(clip: Clip, fps: float | None, times: ArrayLike | None) -> Floats:
    if fps is not None and times is not None:
        raise RangeError("`fps` and `times` exclude each other")
    if times is not None:
        return as_times(times)
    if fps is not None:
        return frame_times(clip.start, clip.end, fps=fps)
    return clip.key_times
