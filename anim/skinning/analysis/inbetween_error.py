"""Inter-frame error of a bake: distance between the motion and linear interpolation of frames.

Joints rotate between keys, and their vertices follow arcs, which chords cut short; a key between two frames is lost.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Clip, Interpolation
from anim.skinning.analysis.extreme_vertices import reduce_scene
from anim.skinning.bake import Baker, prepare_bake

MAX_SEGMENTS = 50_000  # sampled on a few vertices
MAX_SEGMENTS_PER_KEY_INTERVAL = 8  # between two keys the error of LINEAR and slerp changes little; see `_may_spin`
MAX_INTERVALS = 4  # sampled on all vertices
BLOCK_SEGMENTS = 512  # at once
COARSE_PARTS = (0.25, 0.5, 0.75)  # of a segment: an eased motion has no error half-way, but elsewhere
NUM_PARTS = 8  # of a segment, on all vertices


class InbetweenError(NamedTuple):
    """Largest distance (m) of a vertex from linear interpolation between frames, and its time (s)."""

    distance: float
    time: float


@dataclass(frozen=True, slots=True)
class _Segments:
    """Spans without a key or frame inside: (n,) start and end in s, and the index of the frame before each."""

    start: Floats
    end: Floats
    frame: Ints

    def at(self, part: float) -> Floats:
        """Times (n,) at a fraction of each segment; at 1 just before its end, where a STEP track has its full error."""
        if part == 1:
            return np.nextafter(self.end, self.start)
        return self.start + (self.end - self.start) * part

    def select(self, chosen: Ints | slice) -> _Segments:
        return _Segments(self.start[chosen], self.end[chosen], self.frame[chosen])


class InbetweenMetric:
    """Inter-frame errors of the bakes of one baker."""

    def __init__(self, baker: Baker) -> None:
        self._baker = baker
        nodes = frozenset(each.node for each in baker.instances)
        space = "mesh" if baker.bound[0].in_mesh_space else "world"
        self._reduced = prepare_bake(reduce_scene(baker.scene, nodes), space=space, rigid=True, threads=baker.threads)

    def largest_error(self, clip: Clip, times: Floats) -> InbetweenError:
        """Return the largest inter-frame error found between frames at `times` (F,) s, increasing.

        Segments between frames and keys (without splines of rotations, some of those between two keys) are sampled in
        quarters, at keys and before those of STEP, on the extreme vertices of each joint; the intervals with the
        largest errors again in eighths, on all vertices. Elsewhere it may be larger.
        """
        segments = _segments(clip, times)
        errors = _coarse_errors(self._reduced, clip, times, segments)
        chosen = _largest_per_interval(errors, segments.frame)
        found = [_error_in(self._baker, clip, times, segments.select(slice(each, each + 1))) for each in chosen]
        return max(found, default=InbetweenError(0.0, 0.0))


def _segments(clip: Clip, times: Floats) -> _Segments:
    """All segments; of too many some that are evenly distributed, between two keys and in all."""
    keys = clip.key_times if clip.tracks else np.empty(0)
    inside = keys[(keys > times[0]) & (keys < times[-1])]
    knots = np.union1d(times, inside)
    frame = np.searchsorted(times, knots[:-1], side="right") - 1
    key_interval = np.searchsorted(inside, knots[:-1], side="right")
    counts = np.bincount(key_interval, minlength=len(inside) + 1)
    chosen = np.arange(len(frame)) if _may_spin(clip) else _spread(counts)
    if len(chosen) > MAX_SEGMENTS:
        chosen = chosen[np.linspace(0, len(chosen) - 1, MAX_SEGMENTS).round().astype(int)]
    return _Segments(knots[:-1], knots[1:], frame).select(chosen)


def _may_spin(clip: Clip) -> bool:
    """Return whether a spline of quaternions may come near 0, where it turns as far as it likes within one frame."""
    return any(
        track.interpolation is Interpolation.CUBICSPLINE and track.path in ("rotation", "pointer")
        for track in clip.tracks
    )


def _spread(counts: Ints) -> Ints:
    """Indices of the first and the last segment of each key interval, and of others between, up to a number.

    counts: (n,) segments in each, one or more.
    """
    count = np.repeat(counts, counts)
    rank = np.arange(len(count)) - np.repeat(np.cumsum(counts) - counts, counts)
    place = rank * (np.minimum(count, MAX_SEGMENTS_PER_KEY_INTERVAL) - 1) // np.maximum(count - 1, 1)
    return np.flatnonzero((rank == 0) | (np.diff(place, prepend=-1) > 0))


def _coarse_errors(reduced: Baker, clip: Clip, times: Floats, segments: _Segments) -> Floats:
    """The largest error (n,) m of a few vertices in each segment."""
    found = np.zeros(len(segments.frame))
    has_jumps = any(track.interpolation is Interpolation.STEP for track in clip.tracks)
    parts = (0.0, *COARSE_PARTS, 1.0) if has_jumps else (0.0, *COARSE_PARTS)
    for first in range(0, len(found), BLOCK_SEGMENTS):
        block = slice(first, first + BLOCK_SEGMENTS)
        here = segments.select(block)
        before, after = times[here.frame], times[here.frame + 1]
        samples = [here.at(part) for part in parts]
        seconds = np.unique(np.concatenate((before, after, *samples)))
        frames = reduced.bake(clip, times=seconds).load_all().positions
        low, high = frames[np.searchsorted(seconds, before)], frames[np.searchsorted(seconds, after)]
        for at in samples:
            u = ((at - before) / (after - before))[:, None, None]
            error = frames[np.searchsorted(seconds, at)] - (low * (1 - u) + high * u)
            found[block] = np.maximum(found[block], np.sqrt(np.einsum("fvi,fvi->fv", error, error).max(axis=1)))
    return found


def _largest_per_interval(errors: Floats, frame: Ints) -> list[int]:
    """Indices of the worst segments of the intervals with the largest errors."""
    seen: dict[int, int] = {}
    for index in np.argsort(-errors, kind="stable").tolist():
        seen.setdefault(int(frame[index]), index)
        if len(seen) == MAX_INTERVALS:
            break
    return list(seen.values())


def _error_in(baker: Baker, clip: Clip, times: Floats, segment: _Segments) -> InbetweenError:
    """The largest error in one segment, on all vertices."""
    frame = int(segment.frame[0])
    before, after = times[frame], times[frame + 1]
    at = np.unique([segment.at(part / NUM_PARTS)[0] for part in range(NUM_PARTS + 1)])
    seconds = np.unique([before, after, *at])
    frames = baker.bake(clip, times=seconds).load_all().positions
    u = ((at - before) / (after - before))[:, None, None]
    error = frames[np.searchsorted(seconds, at)] - (frames[0] * (1 - u) + frames[-1] * u)
    squared = np.einsum("fvi,fvi->fv", error, error).max(axis=1)
    worst = int(squared.argmax())
    return InbetweenError(float(np.sqrt(squared[worst])), float(at[worst]))
