"""Inputs that are no glTF as documents for the page: vertex caches as morph targets, Euler curves as sticks."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import PurePath

import numpy as np

from anim.caches.options import WriteOptions
from anim.caches.registry import writer_for
from anim.caches.storage import Memory
from anim.caches.transforms.statistics import diagonal
from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import FormatError, RangeError, UnsupportedError
from anim.exchange.euler.evaluate import bounding_size, skeleton
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import scale_motion
from anim.exchange.euler.unit_guess import guess_unit
from anim.exchange.formats import registry
from anim.exchange.formats.registry import TrackReadOptions
from anim.exchange.split_skins import split_by_root
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf import authoring
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.model import VertexCache

ANGLE_TOLERANCE_RAD = math.radians(0.05)  # as `from-euler`
TOLERANCES_PER_DIAGONAL = (1e-5, 1e-3)  # of morph targets; the second where the first needs too many
MAX_CACHE_BYTES = 400_000_000  # of positions; a browser needs several times this
MAX_FLIPBOOK_BYTES = 60_000_000  # of positions; pages store every frame
DEFAULT_NAME = "motion"  # of a clip from a pipe, as `from-euler`
DEFAULT_OPTIONS = TrackReadOptions()


@dataclass(frozen=True, slots=True)
class PageSource:
    """document: what the page shows. notes: lines about differences to the input."""

    document: Document
    notes: list[str]


def read_curves(data: bytes, *, name: str = "", options: TrackReadOptions = DEFAULT_OPTIONS) -> PageSource:
    """Return a BVH, CSV or JSON file of Euler curves as a document: a skeleton, its clip, and sticks for its joints.

    name: of the file, for its format and the clip's name. Lengths of a BVH are scaled as `from-euler` guesses them.
    Raises FormatError for invalid content, RangeError if a CSV or JSON states no convention of its angles.
    """
    form = registry.of_path(name) or registry.of_content(data)
    motion = form.read(data, options)
    notes = list(motion.notes)
    if not form.has_units:
        guess = guess_unit(bounding_size(skeleton(motion)))
        motion = scale_motion(motion, guess.scale)
        notes.append(f"{guess.scale:.4g} m per unit, guessed: {guess.unit}")
    made = from_euler(motion, tolerance=ANGLE_TOLERANCE_RAD, name=PurePath(name).stem or DEFAULT_NAME)
    if not made.clip.tracks:
        raise FormatError("no curve has a key: there is no motion in it")
    bodies = split_by_root(made.skeleton, *stick_mesh(made.skeleton, made.ends))
    return PageSource(authoring.build_document(made.skeleton, [made.clip], bodies), notes)


def convert_cache(cache: VertexCache, name: str = "cache") -> PageSource:
    """Return a vertex cache as a document with morph targets, within 0.001 % of its diagonal, or 0.1 %; Y up.

    Where 256 morph targets do not suffice, every frame is a mesh of its own, shown one at a time. name: of the clip.
    Raises UnsupportedError for caches that are too large for a browser.
    """
    cache = to_up_axis(cache, "y")
    size = 12 * cache.frame_count * cache.vertex_count
    if size > MAX_CACHE_BYTES:
        raise _too_large(cache, size)
    data, error = _encoded(cache, size)
    document = container.read(np.frombuffer(data, np.uint8))
    notes = [f"morph targets: within {error:.3g} m of the cache"] if error else []
    animations = [{**each, "name": name} for each in document.json.get("animations", [])]
    json = {**document.json, "animations": animations} if animations else document.json
    return PageSource(replace(document, json=json), notes)


def _encoded(cache: VertexCache, size: int) -> tuple[bytes, float]:
    """GLB with as exact morph targets as 256 allow, else with a mesh per frame; and its error in m."""
    scale = diagonal(cache)
    for tolerance in TOLERANCES_PER_DIAGONAL:
        memory = Memory("cache.glb")
        with suppress(RangeError):
            written = writer_for(".glb")(cache, memory, WriteOptions(max_error=tolerance * scale or None))
            return memory.files["cache.glb"], written.max_error or 0.0
    if size > MAX_FLIPBOOK_BYTES:
        raise _too_large(cache, size)
    memory = Memory("cache.glb")
    writer_for(".glb")(cache, memory, WriteOptions(layout="flip-scale"))
    return memory.files["cache.glb"], 0.0


def _too_large(cache: VertexCache, size: int) -> UnsupportedError:
    return UnsupportedError(
        f"{cache.frame_count} frames of {cache.vertex_count} vertices are too many for a page "
        f"({size / 1e6:.0f} MB of positions)",
        help="make fewer frames first, by convert-cache with `fps` 10",
    )
