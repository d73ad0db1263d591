"""Removal of keys that became redundant by rounding to the storage format."""

from __future__ import annotations

from collections.abc import Sequence

from anim.model import Clip, Skeleton, Track, parse_weight_pointer
from anim.model.track import share_time_axes
from anim.optimization.options import Request
from anim.optimization.search.plan import Solution
from anim.optimization.tracks.needed_keys import needed_keys
from anim.optimization.tracks.quantization import EncodedKeys
from anim.sampling.weight_pointers import moved_nodes


def drop_redundant_keys(solution: Solution, skeleton: Skeleton, request: Request) -> Solution | None:
    """Return the solution of a clip without redundant keys, if it then takes fewer bytes; None if not.

    Redundant keys are those of `anim.measure.inspect.track_statistics.removable_keys`, as counted by `inspect`; first
    and last keys stay. The motion changes by about a millionth of each track's range and must be verified. Tracks that
    must stay exact keep all keys.
    """
    pairs = list(zip(solution.clip.tracks, solution.stored, strict=True))
    free = [k for k, (track, _) in enumerate(pairs) if not _is_exact(track, skeleton, request)]
    new = dict(zip(free, _drop_from([pairs[k] for k in free], skeleton), strict=True))
    if all(stored is pairs[k][1] for k, (_, stored) in new.items()):
        return None
    slim = [new.get(k, pair) for k, pair in enumerate(pairs)]
    clip = Clip(solution.clip.name, tuple(track for track, _ in slim))
    return Solution(clip, tuple(stored for _, stored in slim), solution.dropped)


def _is_exact(track: Track, skeleton: Skeleton, request: Request) -> bool:
    if track.node is None and parse_weight_pointer(track.pointer) is None:
        return request.bounds.max_pointer_error == 0
    return request.bounds.max_error == 0 or not request.policy.keep.isdisjoint(moved_nodes(skeleton, track))


def _drop_from(pairs: Sequence[tuple[Track, EncodedKeys]], skeleton: Skeleton) -> list[tuple[Track, EncodedKeys]]:
    """The tracks without redundant keys; those that lose none keep their `EncodedKeys`."""
    needed = needed_keys(share_time_axes(track for track, _ in pairs), skeleton)
    return [
        (track, stored if mask.all() else stored.select_keys(mask))
        for (track, mask), (_, stored) in zip(needed, pairs, strict=True)
    ]
