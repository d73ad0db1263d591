"""GA112: constant tracks with several keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips, keep_duration
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.model import Clip


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.repeating_tracks:
            yield file.in_clip(clip.index, count)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a single key in these tracks. Clips keep their duration."""
    return edit_clips(file, found, lambda clip: _single_keys(clip, file))


def _single_keys(clip: Clip, file: CheckedFile) -> Clip:
    from anim.measure.inspect.track_statistics import stats
    from anim.optimization.tracks.clip_ends import single_key  # only fixes import optimizations
    from anim.sampling.batch import concatenate

    found = stats(concatenate(clip.tracks), file.skeleton)
    several = [len(each.times) > 1 + (each.in_tangents is not None) for each in clip.tracks]
    tracks = [
        single_key(each) if several[i] and found.constant[i] and not found.no_effect[i] else each
        for i, each in enumerate(clip.tracks)
    ]
    return keep_duration(clip, tracks)


RULE = Rule(
    "GA112",
    "constant-tracks",
    Severity.INFO,
    "Constant tracks have several keys.",
    "One key is enough; exporters that sample every frame write files five times as large "
    "(KhronosGroup/glTF-Blender-IO#1884).",
    find,
    counted("constant track has several keys", "constant tracks have several keys"),
    "one key is enough; to reduce them: gltf-anim optimize IN OUT",
    fix=Fix("keep the first key", fix, is_safe=True),
)
