"""GA113: tracks that equal the rest pose."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.no_effect_tracks - (clip.no_effect_tracks == sum(clip.tracks.values())):  # one stays
            yield file.in_clip(clip.index, count)


RULE = Rule(
    "GA113",
    "no-effect-tracks",
    Severity.INFO,
    "Tracks equal the rest pose.",
    "They cost bytes. Blending of clips may need them (godotengine/godot#59294).",
    find,
    counted("track equals the rest pose", "tracks equal the rest pose"),
    "unless players blend clips: gltf-anim optimize IN OUT --drop rest",
)
