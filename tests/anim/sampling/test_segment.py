"""Greatest rates of segments: of cubic polynomials in closed form, also where they are extrapolated."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import Interpolation, Track
from anim.sampling import segment


@pytest.mark.parametrize("extent", [(0.0, 1.0), (-0.5, 1.0), (0.0, 1.75), (-2.0, 75.0)])
def test_the_rate_of_a_cubic_is_greatest_at_an_end_of_the_extent(extent: tuple[float, float]) -> None:
    """x = u³ with its exact tangents: dx/du = 3 u²; the others stay."""
    keys, slopes = np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0.0, 0, 0], [3, 0, 0]])
    cube = Track(0, "translation", Interpolation.CUBICSPLINE, [0, 1], keys, slopes, slopes)
    expected = max(3 * u * u for u in extent)
    assert segment.max_rate(cube, np.array([0]), extent=extent) == pytest.approx(expected)


def test_many_segments_of_a_wide_extent_are_sampled_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(0)
    values, slopes = random.normal(size=(50, 3)), random.normal(size=(50, 3))
    long = Track(0, "translation", Interpolation.CUBICSPLINE, np.arange(50.0), values, slopes, slopes)
    whole = segment.max_rate(long, np.arange(49), extent=(-1.0, 3.0))
    sizes: list[int] = []
    derivative = segment.derivative

    def counted(track: Track, left: np.typing.NDArray[np.int64], share: np.typing.NDArray[np.float64]) -> object:
        sizes.append(len(left))
        return derivative(track, left, share)

    monkeypatch.setattr(segment, "BLOCK_SAMPLES", 1000)
    monkeypatch.setattr(segment, "derivative", counted)
    assert segment.max_rate(long, np.arange(49), extent=(-1.0, 3.0)) == whole
    assert len(sizes) > 5
    assert max(sizes) <= 1000
