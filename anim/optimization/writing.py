"""Writing of solutions into a document, the check that it contains them, and its mark."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from anim.gltf.document import Document
from anim.gltf.meshopt.storage import FilteredValues, attach_codes
from anim.gltf.writing import reindex, writer
from anim.measure.equal_clips import first_equal
from anim.model import Clip, Track
from anim.optimization.options import Packing
from anim.optimization.search.plan import Solution
from anim.optimization.tracks.quantization import EncodedKeys

FILTERS = {"quaternion": "QUATERNION", "exponent": "EXPONENTIAL"}  # meshopt's names of EncodedKeys.form
KEY = "gltf-anim"


def write_solutions(document: Document, solutions: Mapping[int, Solution], packing: Packing) -> Document:
    """Return the document with the clips indexed in `solutions` in place of its own; no unused accessors."""
    clips = {i: _clip(each) for i, each in sorted(solutions.items())}
    return reindex.drop_placeholders(writer.replace_sharing(document, clips, extension=packing.extension))


def _clip(solution: Solution) -> Clip:
    """The clip with the codes of its tracks, if any has some."""
    if all(keys.form not in FILTERS for keys in solution.stored):
        return solution.clip
    return Clip(solution.clip.name, tuple(map(_with_codes, solution.clip.tracks, solution.stored)))


def _with_codes(track: Track, stored: EncodedKeys) -> Track:
    if stored.form not in FILTERS:
        return track
    return attach_codes(track, FilteredValues(FILTERS[stored.form], stored.codes))


def changed_clips(read_back: Sequence[Clip], solutions: Mapping[int, Solution]) -> list[int]:
    """Return the indices of the clips that differ from their solution when read from the new document."""
    pairs = [(read_back[i], each.clip) for i, each in solutions.items()]
    first = first_equal(pairs)
    same = {n: _is_same(*pairs[n]) for n in set(first)}
    return [i for i, n in zip(solutions, first, strict=True) if not same[n]]


def _is_same(a: Clip, b: Clip) -> bool:
    """Return whether the keys are equal; their formats may differ."""
    return len(a.tracks) == len(b.tracks) and all(map(Track.has_same_keys, a.tracks, b.tracks))


def add_mark(document: Document, clips: Iterable[Clip], options: str) -> Document:
    """Return the document with a mark of its clips and options in `asset.extras`.

    A repeated command then changes nothing: it would use the bound a second time, since the source's motion is not in
    the file. Unchanged if `extras` is no object.
    """
    asset = document.json["asset"]
    extras = asset.get("extras", {})
    if not isinstance(extras, dict):
        return document
    marked = {**asset, "extras": {**extras, KEY: _mark(clips, options)}}
    return replace(document, json={**document.json, "asset": marked})


def has_mark(document: Document, clips: Iterable[Clip], options: str) -> bool:
    """Return whether the document carries the mark of exactly these clips and options."""
    extras = document.json["asset"].get("extras", {})
    mark = extras.get(KEY) if isinstance(extras, dict) else None
    return mark is not None and mark == _mark(clips, options)


def _mark(clips: Iterable[Clip], options: str) -> str:
    digest = hashlib.blake2b(options.encode(), digest_size=6)
    for clip in clips:
        digest.update(clip.name.encode(errors="surrogatepass"))
        for track in clip.tracks:
            digest.update(f"{track.target} {track.interpolation} {track.values.shape}".encode(errors="surrogatepass"))
            for numbers in (track.times, track.values, track.in_tangents, track.out_tangents):
                digest.update(b"" if numbers is None else numbers.tobytes())
    return f"optimize {digest.hexdigest()}"
