"""Byte limits by searches at steps of the bound, with sizes that rise and fall."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from anim.optimization.stepwise_limit import NEAR_STEPS, StepwiseLimit

SHARED = 100  # bytes of the file apart from clips


class NoisyFile:
    """A file of two clips, whose bytes fall with the bound but for noise, and whose errors are near their bounds."""

    def __init__(self, seed: int = 3, noise: float = 0.02, ceiling: float = 0.1) -> None:
        self.noise, self.seed, self.ceiling = noise, seed, ceiling
        self.searched: list[float] = []
        self.written: list[tuple[int, float]] = []  # bytes and error

    def search(self, bound: float) -> tuple[Mapping[int, Any], Mapping[int, float]]:
        """Return results and sizes within a bound, always the same ones."""
        self.searched.append(bound)
        random = np.random.default_rng([self.seed, round(1e12 * bound)])
        sizes = {i: 1000 * bound ** (-1 / 16) * (1 + self.noise * random.random()) for i in range(2)}
        errors = [bound * random.uniform(0.9, 1) for _ in range(2)]
        return {i: _result(errors[i], sizes[i]) for i in range(2)}, sizes

    def write(self, results: Mapping[int, Any], bound: float) -> int:
        """Return the bytes of the file."""
        size = SHARED + round(float(sum(each.size for each in results.values())))
        self.written.append((size, max(each.verdict.error.max_error for each in results.values())))
        assert self.written[-1][1] <= bound
        return size

    def smallest_error(self, max_bytes: int, likely: float) -> float:
        """Return the smallest error that was written and fits."""
        StepwiseLimit(max_bytes, 1.0, self.ceiling, self.search, self.write).run(likely)
        return min((error for size, error in self.written if size <= max_bytes), default=np.inf)


def _result(error: float, size: float) -> Any:
    return SimpleNamespace(verdict=SimpleNamespace(error=SimpleNamespace(max_error=error)), size=size)


def test_next_to_the_result_nothing_fits() -> None:
    """The result of the best combination has less error still, and leaves few bytes unused."""
    file = NoisyFile()
    error = file.smallest_error(3200, 1e-3)
    alone = [(size, error) for size, error in file.written[:-1]]
    assert error <= min(error for size, error in alone if size <= 3200)
    size = next(size for size, each in file.written if each == error)
    assert 3200 - size < 0.01 * size
    assert len(file.searched) < 12


@pytest.mark.parametrize("likely", [1e-6, 1e-4, 3e-2, 0.1])
def test_a_bound_that_is_not_the_likely_one_is_found(likely: float) -> None:
    assert NoisyFile(noise=0).smallest_error(3200, likely) == NoisyFile(noise=0).smallest_error(3200, 1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_more_bytes_are_hardly_ever_more_error(seed: int) -> None:
    errors = [NoisyFile(seed).smallest_error(limit, 1e-3) for limit in range(3000, 3700, 25)]
    assert np.isfinite(errors).all()
    more = [now / before for before, now in pairwise(errors) if now > before]
    assert len(more) <= 3
    assert max(more, default=1.0) < 1.05


def test_what_never_fits_ends_at_the_ceiling() -> None:
    file = NoisyFile(ceiling=0.01)
    assert file.smallest_error(1000, 1e-4) == np.inf
    assert max(file.searched) == 0.01
    assert len(file.searched) <= 3 * (NEAR_STEPS + 7)


def test_a_plateau_is_left_at_a_distance() -> None:
    """Few keys have the same result at many bounds."""

    class Plateau(NoisyFile):
        def search(self, bound: float) -> tuple[Mapping[int, Any], Mapping[int, float]]:
            self.searched.append(bound)
            size, error = (500.0, 4e-4) if bound > 5e-3 else (600.0, 5e-4) if bound > 1e-3 else (900.0, 1e-4)
            return {0: _result(error, size)}, {0: size}

    assert Plateau().smallest_error(720, 1e-3) == 4e-4
