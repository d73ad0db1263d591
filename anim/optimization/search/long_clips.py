"""Search of clips of any length: long ones part after part, so that memory does not follow their length.

Where two parts meet, all tracks with keys have one with the source's value, so that each part plays as it was measured.
A key inside a long arc would bend it in players with component-wise interpolation: such tracks keep the source's keys.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.model import Clip, Track
from anim.optimization.options import Effort, Packing
from anim.optimization.search.clip_parts import chord_error_at, cut_clip, find_cuts, order_by_motion
from anim.optimization.search.context import Context
from anim.optimization.search.lockstep import ClipPart, SearchRequest, SearchResult, search_clips
from anim.optimization.search.plan import FoundKeys, TrackAction
from anim.optimization.search.source_analysis import source_keys
from anim.optimization.search.source_motion import SourceTrack, key_grid
from anim.optimization.search.trial import storage_tolerances
from anim.optimization.search.trial_batch import CHORD_BOUND_FRACTION
from anim.optimization.tracks import quantization
from anim.optimization.tracks.clip_ends import is_closed
from anim.optimization.tracks.quantization import EncodedKeys, Encoding, Form
from anim.sampling.track import sample

MAX_WHOLE_MATRICES = 80_000  # possible key times × nodes of a clip that is searched at once, in about 120 MB
PART_MATRICES = 40_000
MIN_PART_KEYS = 128


class _PartKeys(NamedTuple):
    """Keys of one track in a part.

    action: in the part. constant: (C,) its value there, unless it has keys. at: (K,) indices of its keys on the grid of
    the clip. values: (K, C). tolerance: of their storage, in units of values.
    """

    action: int
    constant: Floats
    at: Ints
    values: Floats
    tolerance: float


def search_all(context: Context, requests: Sequence[SearchRequest], effort: Effort) -> list[FoundKeys | None]:
    """Return the keys found for each clip; None without a result within all bounds."""
    grids = [key_grid([each.clip.tracks[i] for i in each.free]) for each in requests]
    most = MAX_WHOLE_MATRICES // max(len(context.skeleton), 1)
    short = [n for n, grid in enumerate(grids) if len(grid) <= max(most, 2 * MIN_PART_KEYS)]
    results = search_clips(context, [requests[n] for n in short], effort) if short else []
    found = {n: None if each is None else each.found for n, each in zip(short, results, strict=True)}
    return [
        found[n] if n in found else _search_in_parts(context, each, grids[n], effort) for n, each in enumerate(requests)
    ]


def _search_in_parts(context: Context, request: SearchRequest, grid: Floats, effort: Effort) -> FoundKeys:
    """Search the part with the most motion first: the others have its groups of tracks, and its constants if they can.

    A part without a result keeps the source's keys. grid: (K,) s, possible key times of the clip.
    """
    length = max(PART_MATRICES // max(len(context.skeleton), 1), MIN_PART_KEYS)
    cuts = find_cuts([request.clip.tracks[i] for i in request.free], grid, length)
    limit = CHORD_BOUND_FRACTION * request.bound
    bent = [2 * context.size * chord_error_at(request.clip.tracks[i], grid[cuts]) > limit for i in request.free]
    kept = [i for i, is_bent in zip(request.free, bent, strict=True) if is_bent]
    request = _free_tracks(request, np.flatnonzero(~np.array(bent)).tolist())
    tracks = [request.clip.tracks[i] for i in request.free]
    found: dict[int, list[_PartKeys]] = {}
    part = ClipPart(grid, ())
    for n in order_by_motion(tracks, grid[cuts]) if tracks else ():
        first, last = int(cuts[n]), int(cuts[n + 1])
        part = part._replace(grid=grid[first : last + 1])
        clip = cut_clip(request.clip, float(grid[first]), float(grid[last]))
        (result,) = search_clips(context, [request._replace(clip=clip, part=part)], effort)
        if result is None:
            found[n] = [_source_keys(clip.tracks[i], part.grid, first) for i in request.free]
            continue
        if not part.groups:
            part = part._replace(groups=result.result.groups)
            request = request._replace(shared=_with_constants(request.shared, result))
        found[n] = list(_keys_of_part(result, first, last))
    joined = _join([found[n] for n in sorted(found)], tracks, request.free, grid, context.coding)
    return _with_source_keys(joined, request.clip, kept)


def _free_tracks(request: SearchRequest, some: Sequence[int]) -> SearchRequest:
    """The request for some of its free tracks, by their positions; the others play as in the source."""
    free, shared = tuple(request.free[k] for k in some), tuple(request.shared[k] for k in some)
    return request._replace(free=free, droppable=request.droppable[list(some)], shared=shared)


def _with_source_keys(found: FoundKeys, clip: Clip, kept: Sequence[int]) -> FoundKeys:
    """The result with further tracks of the clip, whose keys are those of the source."""
    keys, on = dict(found.keys), dict(found.on)
    for number, i in enumerate(kept, len(found.tracks)):
        times, first = np.unique(clip.tracks[i].times.astype(np.float32), return_index=True)
        on[number] = np.isin(found.grid, times)
        keys[number] = EncodedKeys(clip.tracks[i].values[first], "float32")
    actions = np.append(found.actions, np.full(len(kept), TrackAction.KEYED, np.int64))
    return FoundKeys(found.grid, (*found.tracks, *kept), actions, keys, on)


def _with_constants(shared: Sequence[Sequence[Floats]], result: SearchResult) -> tuple[Sequence[Floats], ...]:
    """The constants that tracks may take, first those that they have in a part."""
    actions, keys = result.result.actions.tolist(), result.result.keys
    return tuple(
        (keys[k].values[0], *each) if actions[k] == TrackAction.CONSTANT else each for k, each in enumerate(shared)
    )


def _keys_of_part(found: SearchResult, first: int, last: int) -> Iterator[_PartKeys]:
    """Yield the keys of each track in the part between two indices of the clip's grid."""
    result, moving = found.result, found.source.moving
    tolerances = storage_tolerances(result.plan, np.array([each.meters for each in moving]))
    for k, (track, tolerance) in enumerate(zip(moving, tolerances.tolist(), strict=True)):
        action = int(result.actions[k])
        if k in result.on:
            values = result.keys[k].values
            yield _PartKeys(action, values[0], first + np.flatnonzero(result.on[k]), values, tolerance)
        else:
            constant = result.keys[k].values[0] if action == TrackAction.CONSTANT else track.rest
            # within one step of the grid from the source's value to the constant, which is as near there
            at = np.array([first, first + 1, last - 1, last])
            yield _PartKeys(action, constant, at, _between_ends(track, constant), tolerance)


def _source_keys(track: Track, grid: Floats, first: int) -> _PartKeys:
    """The source's keys of a track in a part with the times `grid` (K,), of splines all of them; and its ends.

    first: index of the part's first time on the grid of the clip.
    """
    (is_key,) = source_keys([track], grid, is_part=True)
    values = sample(track, grid[is_key])
    return _PartKeys(TrackAction.KEYED, values[0], first + np.flatnonzero(is_key), values, 0.0)


def _between_ends(track: SourceTrack, constant: Floats) -> Floats:
    """The source's first value, the constant twice, and the source's last value (4, C)."""
    return np.stack((track.values[0], constant, constant, track.values[-1]))


def _join(
    parts: Sequence[Sequence[_PartKeys]], tracks: Sequence[Track], free: Sequence[int], grid: Floats, coding: Encoding
) -> FoundKeys:
    """The keys of tracks from those of each part, in order."""
    actions = np.full(len(tracks), TrackAction.KEYED, np.int64)
    keys, on = {}, {}
    for k, (track, some) in enumerate(zip(tracks, zip(*parts, strict=True), strict=True)):
        actions[k] = _joint_action(some, track.path)
        if actions[k] == TrackAction.CONSTANT:
            keys[k] = quantization.constant_cost(some[0].constant)
        elif actions[k] == TrackAction.KEYED:
            on[k] = np.zeros(len(grid), np.bool_)
            on[k][np.concatenate([each.at for each in some])] = True
            keys[k] = _joint_keys(some, track, coding)
    return FoundKeys(grid, tuple(free), actions, keys, on)


def _joint_action(parts: Sequence[_PartKeys], path: str) -> TrackAction:
    """The action of a track: dropped, or the same constant, if it is so in all parts; else keyed."""
    actions = {each.action for each in parts}
    if actions == {TrackAction.DROPPED}:
        return TrackAction.DROPPED
    constants = np.array([each.constant for each in parts])
    if path == "rotation":
        constants = quaternion.align_signs(constants)
    same = bool((constants == constants[0]).all())
    return TrackAction.CONSTANT if same and TrackAction.KEYED not in actions else TrackAction.KEYED


def _joint_keys(parts: Sequence[_PartKeys], track: Track, coding: Encoding) -> EncodedKeys:
    """The keys of all parts, those where two meet once, in one format."""
    joined = np.concatenate([parts[0].values, *(each.values[1:] for each in parts[1:])])
    if track.path == "rotation":
        joined = quaternion.align_signs(joined)
    if is_closed(track):
        joined[-1] = -joined[0] if track.path == "rotation" and joined[-1] @ joined[0] < 0 else joined[0]
    return quantization.encode(joined, _joint_format(parts, joined, track.path, coding.packing))


def _joint_format(parts: Sequence[_PartKeys], joined: Floats, path: str, packing: Packing) -> Form:
    """The format of all parts; if they have several, that of the smallest tolerance.

    Of half of it with a codec, whose formats round values of a coarser one again.
    """
    keyed = [each for each in parts if each.action == TrackAction.KEYED] or parts
    forms = {quantization.choose_format(each.values, path, each.tolerance, packing) for each in keyed}
    if len(forms) == 1:
        return forms.pop()
    tolerance = min(each.tolerance for each in keyed)
    return quantization.choose_format(joined, path, tolerance if packing is Packing.CORE else tolerance / 2, packing)
