"""The rig of the benchmark of growth, and the exponents it reports."""

from __future__ import annotations

import pytest

from anim.gltf.io import container
from anim.gltf.reading import reader
from tests.benchmarks.growth import exponents, rig


def test_the_rig_has_the_counts_asked_for() -> None:
    document = container.read(rig(3, 2, 5))
    clips = reader.clips(document)
    assert [len(clip.tracks) for clip in clips] == [5, 5, 5]
    assert {len(track.times) for clip in clips for track in clip.tracks} == {61}
    assert len(reader.scene(document).skeleton) == 6
    assert clips[0].tracks[1] != clips[1].tracks[1]


def test_linear_growth_has_the_exponent_1() -> None:
    assert exponents([1, 10, 40], [0.5, 5, 80]) == pytest.approx([1, 2])
