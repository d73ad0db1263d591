"""Words on skin weights that don't add up to 1."""

from __future__ import annotations

from anim.skinning.analysis.weight_sums import WeightSums


def test_sums_near_1_do_not_read_as_1() -> None:
    (words,) = WeightSums("fox", 30, 0, 0.99961, 1.00035).in_words()
    assert "(0.99961 … 1.00035)" in words
