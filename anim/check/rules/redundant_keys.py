"""GA111: keys that their neighbors interpolate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from anim.check.checked_file import CheckedFile
from anim.check.edits import replace_clips, single_keys
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.measure.inspect.track_statistics import KEY_TOLERANCE_PER_RANGE
from anim.units import format_number

WITHIN = f"within {format_number(100 * KEY_TOLERANCE_PER_RANGE, 2)} % of the track's range"


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.redundant_keys:
            yield file.in_clip(clip.index, count)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without these keys. All clips are looked at together, as they share time axes."""
    from anim.optimization.tracks.needed_keys import needed_keys  # only fixes import optimizations

    clips = {i: single_keys(clip, file) for i, clip in file.contents.clips.items()}
    needed = iter(needed_keys([track for clip in clips.values() for track in clip.tracks], file.skeleton))
    new = {}
    for i, clip in clips.items():
        pairs = [(old, *next(needed)) for old in clip.tracks]
        new[i] = replace(clip, tracks=tuple(old if stays.all() else track for old, track, stays in pairs))
    return replace_clips(file, {each.number: new[each.number] for each in found})


RULE = Rule(
    "GA111",
    "redundant-keys",
    Severity.INFO,
    f"Keys are interpolated by their neighbors, {WITHIN}.",
    "They cost bytes, and a difference that small is not visible.",
    find,
    counted(
        f"redundant key (interpolated by its neighbors {WITHIN})",
        f"redundant keys (interpolated by their neighbors {WITHIN})",
    ),
    "to remove those that no vertex needs: gltf-anim optimize IN OUT",
    fix=Fix("remove them", fix, is_safe=True, yields_to=frozenset({"GA102"})),
)
