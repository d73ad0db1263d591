"""VertexCache → vertex animation textures: a vertex is a column, a frame a row (or several rows).

| file | content |
|---|---|
| NAME.exr or .png | positions: pixel x, y of vertex v in frame f: x = v % width, y = f · rows_per_frame + v // width |
| NAME.exr-normal.exr | normals in the same pixels, n · ½ + ½ in a PNG; only if the cache has them |
| NAME.exr.json | metadata for shaders: see `metadata` |
| NAME.exr-mesh.glb | the rest mesh; its TEXCOORD_1 is the center of each vertex's pixel in frame 0 |

For a NAME.png they are NAME.png-normal.png, NAME.png.json and NAME.png-mesh.glb.

With a source the mesh has its materials and texture coordinates, and the pixels' centers in the next free set, `uv_set`
of the JSON.

Row 0 is at the top of the file. A pixel p means position = offset + scale · p, plus the rest mesh if `encoding` is
"offset"; PNG values range from 0 to 1. EXR of floats is lossless and absolute; half floats and PNG are offsets.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches import rest_mesh
from anim.caches.formats import exr, png
from anim.caches.formats.gltf_stream import GlbFile, primitive, write_document
from anim.caches.options import WriteOptions, WriteResult
from anim.caches.source_document.bake_source import BakeSource
from anim.caches.source_document.lookup_mesh import free_coordinate_set, place_lookup_mesh
from anim.caches.storage import Outputs, companion_name
from anim.caches.transforms import statistics
from anim.caches.vat import metadata, presets
from anim.caches.vat.presets import Preset
from anim.errors import RangeError, UnsupportedError
from anim.gltf.authoring_parts import VERTICES
from anim.model import VertexCache

MAX_WIDTH, MAX_HEIGHT = 4096, 8192  # pixels supported by desktop engines
MAX_UNORM16 = 65535


@dataclass(frozen=True, slots=True)
class TextureLayout:
    """Texture layout of vertices. width: pixels. rows: per frame."""

    width: int
    rows: int
    frames: int

    @property
    def height(self) -> int:
        """Total rows."""
        return self.rows * self.frames


@dataclass(frozen=True, slots=True)
class PixelEncoding:
    """Linear encoding: value = offset + scale · pixel, (3,) each; kind: float, half or unorm16."""

    kind: str
    offset: Floats
    scale: Floats

    def pixels(self, numbers: AnyArray) -> AnyArray:
        """Encode values (..., 3) as pixels."""
        if self.kind == "unorm16":
            return np.rint((numbers - self.offset) / self.scale * MAX_UNORM16).clip(0, MAX_UNORM16).astype(np.uint16)
        return numbers.astype(exr.TYPES[self.kind])

    def numbers(self, pixels: AnyArray) -> Floats:
        """Decode pixels (..., 3) to values."""
        shares = pixels / MAX_UNORM16 if self.kind == "unorm16" else pixels.astype(np.float64)
        return self.offset + self.scale * shares


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions, *, ending: str) -> WriteResult:
    """Write textures as ".exr" or ".png", JSON and mesh. Raises RangeError above 4096 × 8192 pixels."""
    engine = presets.preset(writing.preset, ending)
    grid = _grid(cache)
    kind = "unorm16" if ending == ".png" else writing.depth
    if kind not in ("unorm16", *exr.TYPES):
        raise RangeError(f"`depth` is '{kind}' (expected {', '.join(exr.TYPES)})")
    still = rest_mesh.positions(cache)
    uv_set = 1 if writing.source is None else free_coordinate_set(cache, writing.source.document)
    if uv_set >= engine.coordinate_sets:
        raise UnsupportedError(
            f"preset {writing.preset}: its meshes have {engine.coordinate_sets} sets of texture coordinates, and the "
            "source uses all of them",
            help="remove a set from the source, or use another preset",
        )
    base = np.zeros_like(still) if kind == "float" else presets.to_engine(still, engine)
    packed = _encode_pixels(cache, engine, base, kind)
    worst = _write_image(_bands(cache, engine, base, packed), outputs, outputs.main, grid, packed)
    about = metadata.VatMetadata(
        preset=writing.preset,
        position=outputs.main,
        normal=None,
        mesh=companion_name(outputs.main, "-mesh.glb"),
        format=packed.kind,
        width=grid.width,
        rows=grid.rows,
        encoding="absolute" if kind == "float" else "offset",
        offset=tuple(packed.offset.tolist()),
        scale=tuple(packed.scale.tolist()),
        vertices=cache.vertex_count,
        times=tuple(cache.times.tolist()),
        up=cache.up,
        uv_set=uv_set,
    )
    if cache.has_normals:
        name = companion_name(outputs.main, f"-normal{ending}")
        turned = of_directions(kind)
        _write_image(_normal_bands(cache, engine, turned), outputs, name, grid, turned)
        about = about.with_normals(name)
    _write_mesh(cache, still, grid, engine, outputs, about.mesh, writing.source)
    with outputs.create(f"{outputs.main}.json") as file:
        file.write(metadata.text(about, engine))
    advice = engine.advice
    if uv_set >= engine.supported_sets:
        advice += (
            f"the look-up is in set {uv_set} (from 0 on) of the texture coordinates, but the importer of "
            f"{writing.preset} supports only {engine.supported_sets} completely: test it, "
            "or remove a set from the source",
        )
    return WriteResult(worst / engine.per_meter, (*advice, *statistics.notes(cache.times)))


def _grid(cache: VertexCache) -> TextureLayout:
    rows = max(-(-cache.vertex_count // MAX_WIDTH), 1)
    found = TextureLayout(-(-cache.vertex_count // rows), rows, cache.frame_count)
    if found.height > MAX_HEIGHT:
        most = MAX_HEIGHT // rows
        raise RangeError(
            f"{cache.frame_count} frames of {rows} rows don't fit into a texture (at most {most})",
            help="choose fewer frames with `fps`, or trim the clip",
        )
    return found


def of_directions(kind: str) -> PixelEncoding:
    """Return the encoding of values from −1 to 1."""
    return PixelEncoding(kind, np.full(3, -1.0), np.full(3, 2.0)) if kind == "unorm16" else _plain(kind)


def _plain(kind: str) -> PixelEncoding:
    return PixelEncoding(kind, np.zeros(3), np.ones(3))


def _encode_pixels(cache: VertexCache, engine: Preset, base: AnyArray, kind: str) -> PixelEncoding:
    if kind != "unorm16":
        return _plain(kind)
    least, most = np.full(3, np.inf), np.full(3, -np.inf)
    for chunk in cache.chunks():
        moved = presets.to_engine(chunk.positions, engine) - base
        least = np.minimum(least, moved.min(axis=(0, 1), initial=np.inf))
        most = np.maximum(most, moved.max(axis=(0, 1), initial=-np.inf))
    span = most - least
    return PixelEncoding(kind, least, np.where(span > 0, span, 1.0))


Band = tuple[AnyArray, float]  # pixels (n, V, 3) of some frames, and the maximum error


def _bands(cache: VertexCache, engine: Preset, base: AnyArray, packed: PixelEncoding) -> Iterator[Band]:
    for chunk in cache.chunks():
        moved = presets.to_engine(chunk.positions, engine) - base
        pixels = packed.pixels(moved)
        off = packed.numbers(pixels) - moved
        yield pixels, float(np.sqrt(np.einsum("fvi,fvi->fv", off, off).max(initial=0.0)))


def _normal_bands(cache: VertexCache, engine: Preset, packed: PixelEncoding) -> Iterator[Band]:
    for chunk in cache.chunks():
        if chunk.normals is not None:
            yield packed.pixels(presets.to_engine(chunk.normals, engine, lengths=False)), 0.0


def _write_image(
    bands: Iterator[Band], outputs: Outputs, name: str, grid: TextureLayout, packed: PixelEncoding
) -> float:
    worst = [0.0]

    def images() -> Iterator[AnyArray]:
        for pixels, off in bands:
            worst[0] = max(worst[0], off)
            image = np.zeros((len(pixels), grid.rows * grid.width, 3), pixels.dtype)
            image[:, : pixels.shape[1]] = pixels
            yield image.reshape(-1, grid.width, 3)

    if packed.kind == "unorm16":
        with outputs.create(name) as file:
            png.write(images(), file, width=grid.width, height=grid.height)
    else:
        exr.write(np.concatenate(list(images())), outputs, name)
    return worst[0]


def _write_mesh(
    cache: VertexCache,
    still: Floats,
    grid: TextureLayout,
    engine: Preset,
    outputs: Outputs,
    name: str,
    source: BakeSource | None,
) -> None:
    """The rest mesh as a GLB, in glTF's axes: the engine's importer converts it like the preset."""
    v = np.arange(cache.vertex_count)
    uv = np.stack(((v % grid.width + 0.5) / grid.width, (v // grid.width + 0.5) / grid.height), axis=1)
    if engine.is_flipped:
        uv[:, 1] = 1 - uv[:, 1]
    normals = next(cache.chunks()).normals if cache.has_normals else None
    first = None if normals is None else normals[0]
    if source is not None:
        write_document(place_lookup_mesh(cache, still, first, uv, source), outputs, name)
    else:
        _write_plain_mesh(cache, still, first, uv, outputs, name)


def _write_plain_mesh(
    cache: VertexCache, still: Floats, normals: AnyArray | None, uv: AnyArray, outputs: Outputs, name: str
) -> None:
    from pygltflib import Mesh, Node

    file = GlbFile()
    attributes = {
        "POSITION": file.add(still.astype("<f4"), target=VERTICES, bounds=True),
        "TEXCOORD_0": file.add(uv.astype("<f4"), target=VERTICES),
        "TEXCOORD_1": file.add(uv.astype("<f4"), target=VERTICES),
    }
    if normals is not None:
        attributes["NORMAL"] = file.add(normals.astype("<f4"), target=VERTICES)
    indices = file.add_indices(cache.faces, cache.vertex_count)
    file.gltf.meshes.append(Mesh(name="rest", primitives=[primitive(attributes, indices)]))
    file.gltf.nodes.append(Node(name="rest", mesh=0))
    file.gltf.scenes[0].nodes.append(0)
    file.write(outputs, name)
