"""Assignment of tracks to shared time axes: key sets are merged while that saves bytes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats


@dataclass(frozen=True, slots=True)
class SharedAxis:
    """Mask (K,) of the grid's times that are the keys of all tracks `members`."""

    keys: Bools
    members: tuple[int, ...]


def merge_axes(keep: Bools, key_bytes: Floats, *, axis_bytes: float, time_bytes: float) -> list[SharedAxis]:
    """Return the axes of fewest bytes found for tracks that require the keys `keep` (G, K).

    key_bytes: (G,) of one key of each track. An axis costs `axis_bytes` and `time_bytes` per key. The pair whose
    union saves most is merged until none saves anything.
    """
    groups: dict[bytes, list[int]] = {}
    for i, row in enumerate(keep):
        groups.setdefault(row.tobytes(), []).append(i)
    members = list(groups.values())
    sets = np.array([keep[m[0]] for m in members], np.float64)
    width = np.array([key_bytes[m].sum() for m in members])
    count = sets.sum(axis=1)
    cost = axis_bytes + count * (time_bytes + width)
    union = count[:, None] + count - sets @ sets.T
    gain = cost[:, None] + cost - axis_bytes - union * (time_bytes + width[:, None] + width)
    np.fill_diagonal(gain, -np.inf)
    alive = np.ones(len(members), np.bool_)
    for _ in range(len(members) - 1):
        a, b = divmod(int(gain.argmax()), len(members))
        if gain[a, b] <= 0:
            break
        sets[a] = np.maximum(sets[a], sets[b])
        members[a] = members[a] + members[b]
        width[a] += width[b]
        count[a] = sets[a].sum()
        cost[a] = axis_bytes + count[a] * (time_bytes + width[a])
        alive[b] = False
        gain[b] = gain[:, b] = -np.inf
        union_a = count[a] + count - sets @ sets[a]
        row = cost[a] + cost - axis_bytes - union_a * (time_bytes + width[a] + width)
        row[~alive] = row[a] = -np.inf
        gain[a] = gain[:, a] = row
    return [SharedAxis(sets[a] > 0, tuple(members[a])) for a in np.flatnonzero(alive).tolist()]
