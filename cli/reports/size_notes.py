"""Notes on files that grew."""

from __future__ import annotations

from collections.abc import Mapping

from anim.model import Clip, Interpolation
from anim.units import plural

MIN_GROWTH, MIN_GROWTH_BYTES = 1.25, 1000  # of a file's size; below, nobody asks for the reason


def growth_note(before: Mapping[int, Clip], after: Mapping[int, Clip], sizes: tuple[int, int]) -> str:
    """Return a note that tangents made a file larger, or "".

    before, after: clips by index. sizes: of the input and the written file, in bytes.
    """
    if sizes[1] < max(MIN_GROWTH * sizes[0], sizes[0] + MIN_GROWTH_BYTES):
        return ""
    if not (count := len(_cubic_tracks(after) - _cubic_tracks(before))):
        return ""
    became = "is CUBICSPLINE now, with" if count == 1 else "are CUBICSPLINE now, each with"
    return (
        f"{plural(count, 'track')} {became} three values per key instead of one; optimize removes what a stated error "
        "allows"
    )


def _cubic_tracks(clips: Mapping[int, Clip]) -> set[tuple[int, object]]:
    """Index of the clip and target of each track with tangents."""
    cubic = Interpolation.CUBICSPLINE
    return {(i, track.target) for i, clip in clips.items() for track in clip.tracks if track.interpolation is cubic}
