"""Writing of solutions into a document, and the check that it contains exactly them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from anim.gltf.document import Document
from anim.gltf.meshopt import storage
from anim.gltf.writing import reindex, writer
from anim.model import Clip, Track
from anim.optimization.options import Packing
from anim.optimization.search.solution import Solution

FILTERS = {"quaternion": "QUATERNION", "exponent": "EXPONENTIAL"}  # meshopt's names of EncodedKeys.form


def write_solutions(document: Document, solutions: Mapping[int, Solution], packing: Packing) -> Document:
    """Return the document with the clips indexed in `solutions` in place of its own; no unused accessors."""
    clips = {i: each.clip for i, each in sorted(solutions.items())}
    if not packing.extension:
        return reindex.drop_placeholders(writer.replace_clips(document, clips))
    filtered = {
        id(track): storage.FilteredValues(FILTERS[stored.form], stored.codes)
        for each in solutions.values()
        for track, stored in zip(each.clip.tracks, each.stored, strict=True)
        if stored.form in FILTERS
    }
    how = storage.compress_document(packing.extension, filtered)
    return reindex.drop_placeholders(writer.replace_clips(document, clips, packing=how))


def changed_clips(read_back: Sequence[Clip], solutions: Mapping[int, Solution]) -> list[int]:
    """Return the indices of the clips that differ from their solution when read from the new document."""
    return [i for i, each in solutions.items() if not _is_same(read_back[i], each.clip)]


def _is_same(a: Clip, b: Clip) -> bool:
    return len(a.tracks) == len(b.tracks) and all(map(_is_same_track, a.tracks, b.tracks))


def _is_same_track(a: Track, b: Track) -> bool:
    if a.target != b.target or a.interpolation is not b.interpolation:
        return False
    pairs = ((a.times, b.times), (a.values, b.values), (a.in_tangents, b.in_tangents), (a.out_tangents, b.out_tangents))
    return all(x is None if y is None else x is not None and np.array_equal(x, y) for x, y in pairs)
