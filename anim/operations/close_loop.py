"""Closing of clips by the result of their loop analysis."""

from __future__ import annotations

from anim.measure.loops.loop_analysis import Loop
from anim.measure.loops.loop_kind import LoopKind
from anim.model import Clip
from anim.operations.loop import append_first_frame, loop, open_tracks
from anim.operations.selection import track_indices


def close_loop(
    clip: Clip,
    found: Loop,
    *,
    root: int = -1,
    blend: float | None = None,
    tracks: frozenset[int] | None = None,
    frame_rate: float | None = None,
) -> Clip:
    """Return the clip as a loop: with a missing last frame added, and its end corrected over `blend` seconds.

    found: its analysis; of a clip that is closed except some joints only these are corrected. root: node that travels,
    and keeps its translation. blend: seconds, None to add a missing frame only. tracks: indices, None for all.
    frame_rate: of the keys added in the blend, None for even spacing.
    """
    chosen = track_indices(clip, tracks)
    if found.kind is LoopKind.OPEN_BY_ONE_FRAME:
        clip = append_first_frame(clip, fps=found.fps, tracks=chosen, root=root)
    if blend is None:
        return clip
    if found.kind is LoopKind.CLOSED_EXCEPT:
        chosen &= open_tracks(clip)
    travel = {i for i, track in enumerate(clip.tracks) if track.node == root and track.path == "translation"}
    return loop(clip, blend=blend, tracks=chosen - travel, frame_rate=frame_rate)
