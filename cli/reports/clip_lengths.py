"""Clip durations before and after, for the summary line of a command."""

from __future__ import annotations

from collections.abc import Mapping

from anim.gltf.reading.reader import clip_name
from anim.model import Clip
from cli.text import format_span, format_time, plural

LISTED = 3  # clips listed with their durations; of more the sum


def clip_lengths(before: Mapping[int, Clip], after: Mapping[int, Clip]) -> str:
    """Return the duration of every clip that changed it: "'walk' 1 s → 4 s"; of many clips the sum; else "".

    before, after: clips of a file by index. Of a clip that starts after 0 s the time span is given: "0.5–1.5 s".
    """
    spans = {i: [format_span(clip.start, clip.end) for clip in (before[i], after[i])] for i in before}
    changed = {i: f"{was} → {now}" for i, (was, now) in spans.items() if was != now}
    if len(changed) <= LISTED:
        return ", ".join(f"'{clip_name(before[i].name, i)}' {words}" for i, words in changed.items())
    sums = (sum(clips[i].end for i in changed) for clips in (before, after))
    return f"{plural(len(changed), 'clip')} {' → '.join(map(format_time, sums))} in all"
