"""Poses of several clips on one skeleton, each at times of its own, sampled together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.model import Clip, Interpolation, Pose, Skeleton
from anim.model.track import NUM_COMPONENTS
from anim.sampling.batch import ConcatenatedTracks, concatenate
from anim.sampling.pose import Sampler, sample_batch
from anim.sampling.track import sample as sample_track
from anim.sampling.weight_pointers import resolve_weight_pointers
from anim.sampling.world import accumulate, local_matrices


def sample_clips(
    skeleton: Skeleton,
    clips: Sequence[Clip],
    times: Floats,
    *,
    step_times: Floats | None = None,
    groups: Sequence[ConcatenatedTracks] | None = None,
) -> tuple[Pose, list[dict[int, Floats]]]:
    """Return the poses of clips at times (clips, T) s of their own, as one pose of clips × T frames.

    Second, the morph weights (T, M) of each clip by node. step_times: for STEP tracks, by default the same.
    groups: the concatenated tracks of all clips, if the caller has them.
    """
    parts, weights = _sample_parts(skeleton, np.arange(len(skeleton)), clips, times, step_times, groups)
    translation, rotation, scale = (part.reshape(-1, *part.shape[2:]) for part in parts)
    return Pose(times.reshape(-1), translation, rotation, scale), weights


def sample_world_matrices(
    skeleton: Skeleton,
    clips: Sequence[Clip],
    times: Floats,
    *,
    step_times: Floats | None = None,
    groups: Sequence[ConcatenatedTracks] | None = None,
) -> tuple[Floats, list[dict[int, Floats]]]:
    """Return the world matrices (N, clips × T, 3, 4) of the poses of `sample_clips`, and the morph weights.

    Local transforms are only computed over time for nodes with tracks.
    """
    tracks = (track for clip in clips for track in clip.tracks if track.path in NUM_COMPONENTS)
    nodes = np.array(sorted({track.node for track in tracks if track.node is not None}), np.int64)
    parts, weights = _sample_parts(skeleton, nodes, clips, times, step_times, groups)
    at_rest = local_matrices(skeleton, [getattr(skeleton, name)[:, None] for name in NUM_COMPONENTS])
    local = np.swapaxes(np.repeat(np.swapaxes(at_rest, 1, 3), times.size, axis=-1), 1, 3)
    if len(nodes):
        local[nodes] = matrix.from_trs(*(np.swapaxes(part.reshape(-1, *part.shape[2:]), 0, 1) for part in parts))
    local[skeleton.sheared] = skeleton.sheared_local[:, None]
    return accumulate(skeleton, local), weights


def _sample_parts(
    skeleton: Skeleton,
    nodes: Ints,
    clips: Sequence[Clip],
    times: Floats,
    step_times: Floats | None,
    groups: Sequence[ConcatenatedTracks] | None,
) -> tuple[list[Floats], list[dict[int, Floats]]]:
    """Translation, rotation and scale (clips, T, J, ·) of some nodes (J,), all with tracks among them; and weights."""
    parts = {name: np.tile(getattr(skeleton, name)[nodes], (*times.shape, 1, 1)) for name in NUM_COMPONENTS}
    weights: list[dict[int, Floats]] = [{} for _ in clips]
    clip_of_track: Ints = np.repeat(np.arange(len(clips)), [len(clip.tracks) for clip in clips])
    for group in concatenate([track for clip in clips for track in clip.tracks]) if groups is None else groups:
        at = step_times if step_times is not None and group.interpolation is Interpolation.STEP else times
        clip = clip_of_track[group.numbers]
        if group.path in parts:
            node = np.searchsorted(nodes, np.array([track.node for track in group.tracks]))
            values = group.sample(at[clip], group.intervals_of_rows(at, clip))
            parts[group.path][clip[:, None], np.arange(times.shape[1]), node[:, None]] = values
        elif group.path == "weights":
            for i, track, weights_of_track in zip(clip.tolist(), group.tracks, group.sample(at[clip]), strict=True):
                if track.node is not None:
                    weights[i][track.node] = weights_of_track
    held = times if step_times is None else step_times
    for morphs, clip_of_row, *at_row in zip(weights, clips, times, held, strict=True):
        morphs.update(_pointed_weights(skeleton, clip_of_row, *at_row))
    return list(parts.values()), weights


def _pointed_weights(skeleton: Skeleton, clip: Clip, times: Floats, step_times: Floats) -> Iterator[tuple[int, Floats]]:
    """Yield the nodes of a clip with pointers to morph weights, each with its weights (T, M)."""
    resolved = resolve_weight_pointers(skeleton, clip)
    for track in resolved.tracks if resolved is not clip else ():
        if track.node is not None and track.path == "weights":
            yield track.node, sample_track(track, step_times if track.interpolation is Interpolation.STEP else times)


def sample_transforms(
    skeleton: Skeleton, clips: Sequence[Clip], times: Floats, path: str, sample: Sampler = sample_batch
) -> Floats:
    """Return the translation, rotation or scale (C, N, B, F) of all nodes in B clips at `times` (B, F) s.

    Contiguous over the times of a clip. path: which of them. sample: as of `PoseSampler`.
    """
    rest: Floats = getattr(skeleton, path).T
    found = np.repeat(rest[:, :, None], times.size, axis=2).reshape(*rest.shape, *times.shape)
    tracks = [(b, track) for b, clip in enumerate(clips) for track in clip.tracks if track.path == path]
    clip_of_track = np.array([b for b, _ in tracks], np.int64)
    for group in concatenate([track for _, track in tracks]):
        clip = clip_of_track[group.numbers]
        values = sample(group, times[clip], group.intervals_of_rows(times, clip))
        node = np.array([track.node for track in group.tracks])
        found[:, node, clip] = np.moveaxis(values, 2, 0)
    return found
