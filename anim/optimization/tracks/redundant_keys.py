"""Removal of keys that became redundant by rounding to the storage format."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from anim.model import Clip, Skeleton, Track
from anim.model.track import share_time_axes
from anim.optimization.options import Request
from anim.optimization.search.plan import Solution
from anim.optimization.tracks.needed_keys import needed_keys
from anim.optimization.tracks.quantization import EncodedKeys


def drop_redundant_keys(solutions: Mapping[int, Solution], skeleton: Skeleton, request: Request) -> dict[int, Solution]:
    """Return the solutions, by index of the clip, that take fewer bytes without redundant keys; no others.

    Redundant keys are those of `anim.measure.inspect.track_statistics.removable_keys` over all clips together, as
    counted by `inspect`; first and last keys stay. The motion changes by about a millionth of each track's range and
    must be verified again. Tracks that must stay exact keep all keys.
    """
    places = [(n, k) for n, each in solutions.items() for k in range(len(each.stored))]
    free = [(n, k) for n, k in places if not _is_exact(solutions[n].clip.tracks[k], request)]
    old = [(solutions[n].clip.tracks[k], solutions[n].stored[k]) for n, k in free]
    new = _drop_from(old, skeleton)
    changed = {place: pair for place, pair, was in zip(free, new, old, strict=True) if pair[1] is not was[1]}
    return {n: _changed_solution(solutions[n], n, changed) for n in sorted({n for n, _ in changed})}


def _is_exact(track: Track, request: Request) -> bool:
    if track.node is None:
        return request.bounds.max_pointer_error == 0
    return request.bounds.max_error == 0 or track.node in request.policy.keep


def _drop_from(pairs: Sequence[tuple[Track, EncodedKeys]], skeleton: Skeleton) -> list[tuple[Track, EncodedKeys]]:
    """The tracks without redundant keys; those that lose none keep their `EncodedKeys`."""
    needed = needed_keys(share_time_axes(track for track, _ in pairs), skeleton)
    return [
        (track, stored if mask.all() else stored.select_keys(mask))
        for (track, mask), (_, stored) in zip(needed, pairs, strict=True)
    ]


def _changed_solution(
    solution: Solution, number: int, changed: Mapping[tuple[int, int], tuple[Track, EncodedKeys]]
) -> Solution:
    pairs = zip(solution.clip.tracks, solution.stored, strict=True)
    new = [changed.get((number, k), pair) for k, pair in enumerate(pairs)]
    clip = Clip(solution.clip.name, tuple(track for track, _ in new))
    return Solution(clip, tuple(stored for _, stored in new), solution.dropped)
