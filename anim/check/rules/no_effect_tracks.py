"""GA113: tracks that equal the rest pose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips, remove_tracks
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.measure.inspect.track_statistics import stats
from anim.model import Clip
from anim.sampling.batch import concatenate


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips, with the count that `inspect` lists; not those of one such track alone: a clip keeps one."""
    for clip in file.facts.clips:
        is_kept = clip.no_effect_tracks == sum(clip.tracks.values()) == 1
        if clip.no_effect_tracks and not is_kept:
            yield file.in_clip(clip.index, clip.no_effect_tracks)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without these tracks. Clips keep one track, and their duration."""
    return edit_clips(file, found, lambda clip: _with_effect(clip, file))


def _with_effect(clip: Clip, file: CheckedFile) -> Clip:
    no_effect = stats(concatenate(clip.tracks), file.skeleton).no_effect
    return remove_tracks(clip, [i for i in range(len(clip.tracks)) if no_effect[i]])


RULE = Rule(
    "GA113",
    "no-effect-tracks",
    Severity.INFO,
    "Tracks equal the rest pose.",
    "They cost bytes. Blending of clips may need them (godotengine/godot#59294).",
    find,
    counted("track equals the rest pose", "tracks equal the rest pose"),
    "unless players blend clips: gltf-anim optimize IN OUT --drop rest",
    fix=Fix("remove them, which blending of clips may show", fix, is_safe=False),
)
