"""GA015: channels without a target that players know."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.check.rules.unused_samplers import in_animation
from anim.gltf.document import Json, json_array
from anim.gltf.validation.channel_targets import channel_target
from anim.units import plural


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for i, animation in enumerate(json_array(file.json, "animations")):
        if ignored := _num_ignored(file, i, animation["channels"]):
            yield in_animation(file, i, problem=f"{plural(ignored, 'channel')} with an unknown target")


def _num_ignored(file: CheckedFile, number: int, channels: list[Json]) -> int:
    clip = file.contents.clips.get(number)
    if clip is not None:  # its tracks are the other channels
        return len(channels) - len(clip.tracks)
    return sum(channel_target(channel) is None for channel in channels)


RULE = Rule(
    "GA015",
    "ignored-channels",
    Severity.INFO,
    "A clip has channels whose target no player knows.",
    "glTF 2.0: channels without a node, or with an unknown path, are ignored.",
    find,
    advice="players skip them; they stay unchanged",
)
