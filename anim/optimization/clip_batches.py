"""Batches of clips that are optimized side by side."""

from __future__ import annotations

from collections.abc import Sequence

from anim.optimization.clip import Task
from anim.optimization.search.source_motion import key_grid
from anim.sampling.scene_parts import SceneDivider

BATCH_KEYS = 300  # times of possible keys, in all, of clips that are optimized side by side: twice as many are measured
BATCH_MATRICES = 40_000  # those times × nodes
BATCH_CLIPS = 16  # more would leave processes of `workers` without work


def batch_clips(tasks: Sequence[tuple[int, Task]], divider: SceneDivider) -> list[list[tuple[int, Task]]]:
    """Return the tasks in batches of clips with about as many times, the longest first.

    They depend on the clips alone, and not on the number of processes, so that the result does not either. Clips that
    move few of many nodes come last, in batches that together move few.
    tasks: of each clip, its number in the file and its task. divider: of the scene.
    """
    lengths = [len(key_grid(task.clip.tracks)) for _, task in tasks]
    nodes = [divider.part_nodes([task.clip]) for _, task in tasks]
    batches: list[list[tuple[int, Task]]] = []
    batch = _Batch(divider)
    for n in sorted(range(len(tasks)), key=lambda n: (nodes[n] is not None, -lengths[n], tasks[n][0])):
        if not batches or not batch.add(lengths[n], nodes[n]):
            batches.append([])
            batch = _Batch(divider)
            batch.add(lengths[n], nodes[n])
        batches[-1].append(tasks[n])
    return batches


class _Batch:
    """Clips that are optimized side by side: their number and nodes, and the times of the longest, which is first."""

    def __init__(self, divider: SceneDivider) -> None:
        self._divider = divider
        self._count = self._longest = 0
        self._nodes: frozenset[int] | None = None

    def add(self, length: int, part: frozenset[int] | None) -> bool:
        """Return whether another clip fits, which is then added; the first one always does.

        length: number of its times. part: the nodes of the part of the scene that it moves, None if that isn't small.
        """
        if self._count and (part is None) is not (self._nodes is None):
            return False
        longest = self._longest or length
        nodes = None if part is None else part.union(self._nodes or ())
        size = len(self._divider.scene.skeleton) if nodes is None else len(nodes)
        most = min(BATCH_KEYS, BATCH_MATRICES // max(size, 1))
        is_full = self._count == BATCH_CLIPS or (self._count + 1) * longest > most
        if self._count and (is_full or (nodes is not None and size > self._divider.max_nodes)):
            return False
        self._count, self._longest, self._nodes = self._count + 1, longest, nodes
        return True
