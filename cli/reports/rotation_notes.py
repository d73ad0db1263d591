"""Notes on rotation keys that are not unit quaternions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from anim.gltf.reading import reader
from anim.measure.inspect.track_statistics import non_unit_keys
from anim.model import Clip
from anim.units import plural
from cli.text import Reporter


def describe_non_unit_keys(counts: Sequence[tuple[str, int, int]]) -> str:
    """Return "3 rotation keys of clip 'walk' are not unit quaternions", or "" without any.

    counts: name, index and number of such keys of each clip.
    """
    found = [(name, index) for name, index, count in counts if count]
    num_keys = sum(count for _, _, count in counts)
    words = "is not a unit quaternion" if num_keys == 1 else "are not unit quaternions"
    return f"{plural(num_keys, 'rotation key')} of {reader.clip_labels(found)} {words}" if found else ""


def normalized_keys_note(clips: Mapping[int, Clip], reporter: Reporter) -> None:
    """Note the keys that a bake of clips, by index, normalizes."""
    counts = [(clip.name, index, sum(non_unit_keys(clip.tracks))) for index, clip in clips.items()]
    if words := describe_non_unit_keys(counts):
        reporter.info(f"note: {words}; the bake normalizes rotations, as most players do")
