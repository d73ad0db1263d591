"""Size estimate of a trial: bytes of JSON, time axes and keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from anim.arrays import Ints
from anim.optimization.search.axis_merging import SharedAxis
from anim.optimization.search.plan import TrackAction
from anim.optimization.search.source_motion import PATHS, SourceMotion
from anim.optimization.tracks.quantization import MAX_INT16, EncodedKeys, Encoding, storage_level

INT16_STEP = 1 / MAX_INT16
SIMILARITY_PROBES = 8  # number of times at which tracks are compared before they are at all times


class SizeEstimate:
    """Size estimates for the tracks of one clip; tracks with equal keys on one axis are stored once."""

    def __init__(self, source: SourceMotion, coding: Encoding) -> None:
        self._coding = coding
        self._paths = [each.path for each in source.moving]
        self._first_similar = _first_similar(source)

    def size(self, actions: Ints, keys: Mapping[int, EncodedKeys], axes: Sequence[SharedAxis]) -> float:
        """Return the bytes of JSON, time axes and keys. actions: (G,) of the tracks. keys: by track."""
        moving = {(n, keys[i].name): keys[i] for n, axis in enumerate(axes) for i in axis.members}
        return self._overhead(actions, axes, len(moving)) + self._coding.size(list(moving.values()))

    def min_size(self, actions: Ints, axes: Sequence[SharedAxis], tolerances: Sequence[float]) -> float:
        """Return the least that the size can be, before keys are computed: similar tracks may have equal ones.

        tolerances: (G,) of the storage, in units of values. Tracks that are further apart are taken for different.
        """
        moving: dict[tuple[int, int], float] = {}
        for n, axis in enumerate(axes):
            count = axis.num_keys
            for i in axis.members:
                size = self._coding.min_size(count, self._paths[i], tolerances[i])
                name = n, self._first_similar[i]
                moving[name] = min(moving.get(name, size), size)
        return self._overhead(actions, axes, len(moving)) + sum(moving.values())

    def storage_level(self, track: int, tolerance: float) -> int:
        """Return a number that is equal for tolerances with which the keys of a track are stored equally."""
        return storage_level(self._paths[track], tolerance, self._coding.packing)

    def _overhead(self, actions: Ints, axes: Sequence[SharedAxis], num_moving: int) -> float:
        """Bytes of JSON and of time axes, if `num_moving` tracks have keys of their own."""
        prices = self._coding.byte_costs
        text = (
            prices.track * num_moving
            + prices.repeated * (np.count_nonzero(actions == TrackAction.KEYED) - num_moving)
            + prices.single_key * np.count_nonzero(actions == TrackAction.CONSTANT)
        )
        return text + sum(prices.axis + self._coding.time_bytes * axis.num_keys for axis in axes)


def _first_similar(source: SourceMotion) -> list[int]:
    """For each track the first of its path (or itself) with nearly its values: less than a step of int16 apart."""
    first = list(range(len(source.moving)))
    for path in PATHS:
        members = [i for i, each in enumerate(source.moving) if each.path == path]
        probes = np.array([source.moving[i].values[:: max(len(source.at) // SIMILARITY_PROBES, 1)] for i in members])
        for k, i in enumerate(members):
            if first[i] == i:
                near = np.flatnonzero(np.abs(probes[k + 1 :] - probes[k]).max(axis=(1, 2), initial=0.0) < INT16_STEP)
                for j in (members[k + 1 + n] for n in near.tolist()):
                    if first[j] == j and np.abs(source.moving[j].values - source.moving[i].values).max() < INT16_STEP:
                        first[j] = i
    return first
