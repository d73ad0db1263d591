"""Operations: Clip → Clip, one verb each. The given clip is not changed.

    from anim import ops
    asset.map_clips(lambda clip: ops.resample(clip, fps=30))
    asset.map_clips(lambda clip: ops.ease(ops.trim(clip, start=0.5, rebase=True), easing="smoothstep"))

All take `tracks`, the indices of the tracks to change; all by default. `select_tracks` gives those of some nodes.

    resample            keys at a frame rate
    ease, warp          easing between keys, or over a time range; easings by name: anim.EASINGS, "cubic-bezier(…)"
    retime              speed, duration, reverse, ping-pong, offset
    trim                a part, with exact ends
    loop                correct the end so that it meets the start
    append_first_frame  complete a loop that lacks its last frame
    spline              smooth curves through the keys; rules by name: anim.TANGENTS, "tcb(0, 0, 0.5)"
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from anim.arguments import glob_list
from anim.errors import RangeError
from anim.model import Clip, Skeleton
from anim.model.track import PATHS
from anim.operations.ease import ease
from anim.operations.loop import append_first_frame, loop
from anim.operations.resample import resample
from anim.operations.retime import retime
from anim.operations.selection import Selection
from anim.operations.spline import spline
from anim.operations.time_warp import warp
from anim.operations.trim import trim

__all__ = [
    "append_first_frame",
    "ease",
    "loop",
    "resample",
    "retime",
    "select_tracks",
    "spline",
    "trim",
    "warp",
]

TRACK_PATHS = (*PATHS, "pointer")


def select_tracks(
    clip: Clip,
    skeleton: Skeleton,
    *,
    nodes: str | Sequence[str] | None = None,
    paths: str | Sequence[str] | None = None,
) -> frozenset[int]:
    """Return the indices of the tracks of some nodes (globs) and paths: "translation", "rotation", ….

    None selects all. Raises NotFoundError for a glob that matches no node, RangeError for an unknown path or an empty
    list.
    ops.resample(clip, fps=30, tracks=ops.select_tracks(clip, skeleton, nodes=["*Hand*"]))
    """
    chosen_paths = glob_list(paths, "paths")
    for path in chosen_paths:
        if path not in TRACK_PATHS:
            near = difflib.get_close_matches(path, TRACK_PATHS, n=1, cutoff=0.4)
            raise RangeError(
                f"paths has '{path}' (expected {', '.join(TRACK_PATHS)})",
                help=f"did you mean '{near[0]}'?" if near else "",
            )
    return Selection((), glob_list(nodes, "nodes"), chosen_paths).chosen_tracks(clip, skeleton)
