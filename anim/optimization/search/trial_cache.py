"""Results of trials by what was decided in them: other budgets often lead to the same keys."""

from __future__ import annotations

from collections.abc import Hashable

from anim.optimization.search.plan import TrialResult

MAX_CACHED_VALUES = 2_000_000  # 16 MB, of all clips that are searched together; a larger cache is cleared


class TrialCache:
    """Results of the trials of one clip of several, as measured with slerp."""

    def __init__(self, num_clips: int = 1) -> None:
        self._max_values = MAX_CACHED_VALUES // num_clips
        self._results: dict[Hashable, TrialResult] = {}
        self._num_values = 0

    def get(self, name: Hashable) -> TrialResult | None:
        """Return the result of an earlier trial with the same decisions."""
        return self._results.get(name)

    def add(self, name: Hashable, result: TrialResult) -> None:
        """Keep a result for later trials with the same decisions."""
        if name in self._results:
            return
        self._num_values += result.usage.size + sum(each.values.size for each in result.keys.values())
        if self._num_values > self._max_values:
            self._results.clear()
            self._num_values = 0
        self._results[name] = result
