"""VertexCache → .glb with morph targets, supported by every viewer, interpolated between frames.

Three encodings are tried, and the smallest with every vertex of every frame within the limit is written: `keyframes`,
one target for each frame that linear interpolation does not reproduce; `basis`, few shapes (principal components) with
a weight each per frame; `both`, the shapes of the retained frames. Between frames weights are linear, and so are
vertices, hence the maximum error over the frames is the maximum over all times. All weights are within 0…1.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.formats.gltf_stream import GlbFile, primitive, signed, write_document
from anim.caches.formats.morph_encoding import MAX_INT16, MorphEncoding, encode_morphs, fit_directions
from anim.caches.options import MAX_TARGETS, WriteOptions, WriteResult
from anim.caches.source_document.changed_references import reference_notes
from anim.caches.source_document.morph_targets import replace_by_morphs
from anim.caches.storage import Outputs
from anim.caches.transforms import statistics
from anim.caches.transforms.pca import fit_basis
from anim.caches.transforms.resample import reduce_frames
from anim.errors import RangeError
from anim.gltf.authoring_parts import VERTICES
from anim.gltf.document import Json
from anim.memory import MemoryBudget
from anim.model import FrameChunk, VertexCache
from anim.units import plural

DEFAULT_ERROR_PER_DIAGONAL = 1e-3  # fraction of the diagonal, without a given limit
POSITION_BYTES = 36  # of a vertex in a frame: float32, in memory three times
PRODUCT_BYTES = 8  # of each pair of frames, of which the shapes are computed (`pca.fit_basis`)
PORTABLE_TARGETS = 8  # guaranteed by glTF; most engines support more
BATCH_FRAMES = 16  # frames compared at a time
LIMIT_FRACTIONS = 0.98, 0.5  # fractions of the limit, reserve for rounding to float32; the second if the first fails
NAME, EXTRAS = "cache", "gltf_anim"


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write the smallest encoding within `writing.max_error` m, by default 0.1 % of the diagonal.

    Raises UnsupportedError for more frames than the limit of memory allows, RangeError if no encoding is within.
    """
    check_frames(cache.frame_count, cache.vertex_count)
    whole = cache.load_all()
    limit = (
        writing.max_error if writing.max_error is not None else DEFAULT_ERROR_PER_DIAGONAL * statistics.diagonal(cache)
    )
    best = _smallest_encoding(
        whole.positions, cache.times, limit, quantize=writing.quantize, max_targets=writing.max_targets
    )
    if best is None:
        quantized = ", or leave out `quantize`" if writing.quantize else ""
        raise RangeError(
            f"{plural(writing.max_targets, 'morph target')} can't keep every vertex within {limit:.3g} m",
            help=f"allow a larger `max_error`, more `max_targets` (WebGL2 promises {MAX_TARGETS}){quantized}, or use "
            "`layout` flip-visibility",
        )
    form, worst = best
    lost: tuple[str, ...] = ()
    if writing.source is None:
        _write(cache, whole, form, outputs, quantize=writing.quantize)
    else:
        normals, tangents = fit_directions(whole.normals, form), fit_directions(whole.tangents, form)
        extras = _extras(cache, form)
        document = replace_by_morphs(
            cache, form, normals, tangents, writing.source, extras=extras, quantize=writing.quantize
        )
        write_document(document, outputs)
        lost = reference_notes(writing.source, document.json)
    return WriteResult(worst, (*_notes(form, cache.frame_count), *lost))


def check_frames(frames: int, vertices: int) -> None:
    """Raise UnsupportedError for more frames of so many vertices than memory allows, before any is computed."""
    MemoryBudget(0).check(
        max(POSITION_BYTES * frames * vertices, PRODUCT_BYTES * frames**2),
        f"morph targets need all frames in memory: {frames} of {plural(vertices, 'vertex', 'vertices')}",
        help="choose fewer with `fps`, or `layout` flip-visibility, or write .usdc, .npz, .pc2 or .mdd (streamed), or "
        "raise `memory_limit`",
    )


def _smallest_encoding(
    positions: AnyArray, times: Floats, limit: float, *, quantize: bool, max_targets: int
) -> tuple[MorphEncoding, float] | None:
    """The smallest encoding within the limit as stored, and its error; None if there is none."""

    def within(forms: Iterable[MorphEncoding]) -> list[tuple[MorphEncoding, float]]:
        changed = (encode_morphs(form, quantize=quantize) for form in forms)
        errors = ((form, _worst(positions, times, form)) for form in changed)
        return [(form, error) for form, error in errors if error <= limit]

    kept = reduce_frames(positions, times, limit * LIMIT_FRACTIONS[0])
    most = len(kept) - 1
    found: list[tuple[MorphEncoding, float]] = []
    for margin in LIMIT_FRACTIONS:
        found = found or within(_pca_targets(positions, times, limit * margin, most=min(most, max_targets)))
    fewest = min((len(form.targets) for form, _ in found), default=most)
    if most <= min(fewest + 1, max_targets):
        found += within([_frame_targets(positions, kept)])
    return min(found, key=lambda each: each[0].size(quantize=quantize), default=None)


def _pca_targets(positions: AnyArray, times: Floats, limit: float, *, most: int) -> Iterator[MorphEncoding]:
    """Candidate encodings of few shapes; their size depends mostly on the target count."""
    for name, share in (("basis", 0.0), ("both", 0.5)):
        frames = reduce_frames(positions, times, limit * share) if share else np.arange(len(positions))
        if share and len(frames) == len(positions):
            continue
        found = fit_basis(positions[frames], limit * (1 - share), most=most)
        if found is not None:
            most = len(found.shapes)
            yield MorphEncoding(name, found.base, found.shapes, frames, found.weights)


def _frame_targets(positions: AnyArray, kept: Ints) -> MorphEncoding:
    base = positions[kept[0]]
    weights = np.concatenate((np.zeros((1, len(kept) - 1)), np.eye(len(kept) - 1)))
    return MorphEncoding("keyframes", base, positions[kept[1:]] - base, kept, weights)


def _worst(positions: AnyArray, times: Floats, form: MorphEncoding) -> float:
    """Maximum distance of a vertex of any frame from its position in a viewer."""
    keys = times[form.frames].astype(np.float32)  # as stored
    flat = form.targets.reshape(len(form.targets), form.base.size)
    worst = 0.0
    for first in range(0, len(positions), BATCH_FRAMES):
        rows = slice(first, first + BATCH_FRAMES)
        weights = np.empty((len(times[rows]), len(flat)), np.float32)
        for i, column in enumerate(form.weights.T):
            weights[:, i] = np.interp(times[rows], keys, column)
        placed = form.base + (weights @ flat).reshape(-1, *form.base.shape)
        off = (np.float32(form.scale) * placed - positions[rows]).astype(np.float64)
        here = np.sqrt(np.einsum("fvi,fvi->fv", off, off).max(initial=0.0))
        worst = float(np.maximum(worst, here))  # NaN stays, as of differences beyond float32: it is within no limit
    return worst


def _write(cache: VertexCache, whole: FrameChunk, form: MorphEncoding, outputs: Outputs, *, quantize: bool) -> None:
    from pygltflib import Animation, AnimationChannel, AnimationChannelTarget, AnimationSampler, Mesh, Node

    file = GlbFile()
    gltf = file.gltf
    indices = file.add_indices(cache.faces, cache.vertex_count)
    attributes = {"POSITION": file.add(form.base.astype("<f4"), target=VERTICES, bounds=True)}
    turns, along = fit_directions(whole.normals, form), fit_directions(whole.tangents, form)
    if turns is not None:
        attributes["NORMAL"] = file.add(turns[0].astype("<f4"), target=VERTICES)
    if along is not None and cache.handedness is not None:
        attributes["TANGENT"] = file.add(signed(along[0], cache.handedness), target=VERTICES)
    targets = []
    for i, target in enumerate(form.targets):
        rows = np.rint(target * MAX_INT16).astype("<i2") if quantize else target.astype("<f4")
        entry = {"POSITION": file.add(rows, target=VERTICES, normalized=quantize, bounds=True)}
        if turns is not None:
            entry["NORMAL"] = file.add(turns[1 + i].astype("<f4"), target=VERTICES)
        if along is not None:
            entry["TANGENT"] = file.add(along[1 + i].astype("<f4"), target=VERTICES)
        targets.append(entry)
    first = [float(weight) for weight in form.weights[0]]
    gltf.meshes.append(Mesh(primitives=[primitive(attributes, indices, targets)], weights=first or None))
    scale = [form.scale] * 3 if form.scale != 1 else None
    gltf.nodes.append(Node(name=NAME, mesh=0, scale=scale, extras=_extras(cache, form)))
    gltf.scenes[0].nodes.append(0)
    if targets and len(form.frames) > 1:
        sampler = AnimationSampler(
            input=file.add(cache.times[form.frames].astype("<f4")[:, None], bounds=True),
            output=file.add(form.weights.astype("<f4").reshape(-1, 1)),
            interpolation="LINEAR",
        )
        channel = AnimationChannel(sampler=0, target=AnimationChannelTarget(node=0, path="weights"))
        gltf.animations.append(Animation(name=NAME, channels=[channel], samplers=[sampler]))
    if quantize and targets:
        gltf.extensionsUsed = ["KHR_mesh_quantization"]
        gltf.extensionsRequired = ["KHR_mesh_quantization"]
    file.write(outputs, outputs.main)


def _extras(cache: VertexCache, form: MorphEncoding) -> Json:
    return {EXTRAS: {"cache": form.kind, "up": cache.up}}


def _notes(form: MorphEncoding, frames: int) -> tuple[str, ...]:
    words = {"keyframes": "a target per kept frame", "basis": "shapes and weights", "both": "shapes of kept frames"}
    targets, keys = plural(len(form.targets), "morph target"), plural(len(form.frames), "key")
    notes = [f"{targets} ({words[form.kind]}), {keys} for {plural(frames, 'frame')}"]
    if len(form.targets) > PORTABLE_TARGETS:
        notes.append(
            f"glTF promises {PORTABLE_TARGETS} targets at a time; three.js, Babylon.js and Blender take hundreds"
        )
    return tuple(notes)
