"""Textures → VertexCache, by their JSON metadata."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.formats import exr, png
from anim.caches.options import ReadOptions
from anim.caches.storage import Inputs, open_bytes, size_of
from anim.caches.vat import metadata, presets
from anim.caches.vat.metadata import VatMetadata
from anim.caches.vat.presets import Preset
from anim.caches.vat.writer import PixelEncoding, of_directions
from anim.errors import FormatError
from anim.gltf.io import container
from anim.gltf.reading import reader as gltf
from anim.memory import MemoryBudget
from anim.model import FrameChunk, VertexCache


def read(inputs: Inputs, reading: ReadOptions) -> VertexCache:
    """Return the frames in textures, to their precision; faces are those of the companion mesh."""
    name = f"{inputs.main}.json"
    if name not in inputs.names():
        raise FormatError(f"'{name}' is not beside it, and only that says what the pixels mean")
    try:
        with open_bytes(inputs, name) as data:
            about = metadata.parse(data)
    except FormatError as error:
        raise error.at(f"'{name}'", ": ") from None
    engine = presets.PRESETS[about.preset]
    rest, faces = _mesh(inputs, about)
    packed = PixelEncoding(about.format, np.array(about.offset), np.array(about.scale))
    numbers = packed.numbers(_pixels(inputs, about.position, about))
    if about.encoding == "offset":
        numbers = numbers + presets.to_engine(rest, engine)
    positions = presets.from_engine(numbers, engine).astype(np.float32)
    normals = None if about.normal is None else _normals(inputs, about.normal, about, engine)
    chunk = FrameChunk(0, positions, normals)
    return VertexCache(
        np.array(about.times),
        about.vertices,
        faces,
        lambda: iter((chunk,)),
        rest=rest,
        has_normals=normals is not None,
        up="z" if about.up == "z" else "y",
    )


def _mesh(inputs: Inputs, about: VatMetadata) -> tuple[Floats, Ints]:
    """Positions (V, 3) and faces of the companion mesh, whose nodes are in the order of the vertices."""
    with open_bytes(inputs, about.mesh) as data:
        scene = gltf.scene(container.read(np.frombuffer(data, np.uint8)))
    if scene.vertex_count != about.vertices:
        raise FormatError(f"'{about.mesh}' has {scene.vertex_count} vertices (the JSON says {about.vertices})")
    meshes = [each.mesh for each in scene.instances]
    starts = np.cumsum([0, *(len(each.positions) for each in meshes)])
    faces = [each.faces + start for each, start in zip(meshes, starts, strict=False)]
    return np.concatenate([each.positions for each in meshes]), np.concatenate(faces)


def _pixels(inputs: Inputs, name: str, about: VatMetadata) -> AnyArray:
    """The pixels (F, V, 3) of all frames."""
    width, height = about.width, about.rows * len(about.times)
    MemoryBudget(_stored_bytes(inputs, name)).add(3 * 8 * 4 * width * height)  # as pixels, float64 and positions
    if about.format == "unorm16":
        with open_bytes(inputs, name) as data:
            image: AnyArray = png.read(data, width=width, height=height)
    else:
        image = exr.read(inputs, name, width=width, height=height)
    return image.reshape(len(about.times), -1, 3)[:, : about.vertices]


def _stored_bytes(inputs: Inputs, name: str) -> int:
    with inputs.open(name) as file:
        return size_of(file)


def _normals(inputs: Inputs, name: str, about: VatMetadata, engine: Preset) -> Floats:
    numbers = of_directions(about.format).numbers(_pixels(inputs, name, about))
    turned = presets.from_engine(numbers, engine, lengths=False)
    return turned.astype(np.float32)
