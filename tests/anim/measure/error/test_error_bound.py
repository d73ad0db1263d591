"""The largest displacement against brute force: never understated, and hardly overstated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.error.metric import NOISE, SLACK, ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene, TimeAxis, Track
from anim.operations.resample import resample
from tests.anim.measure.error.brute_force import Find, brute, clip_of, with_track
from tests.clips import clip, track
from tests.files import mark_slow, opened_fixture, opened_path

RNG = np.random.default_rng(3)


@pytest.fixture(
    params=[
        ("biped", "walk"),
        ("biped", "jump"),
        ("biped", "wave"),
        ("tube", None),
        ("arm", None),
        ("morph_cube", "linear"),
        ("morph_cube", "cubic"),
        ("interpolations", None),
        ("pointer", "weights"),
        ("Fox.glb", "Run"),
        ("BitmojiRun.glb", None),
        ("SimpleMorph.gltf", None),
        ("RiggedSimple.gltf", None),
    ],
    ids=lambda param: f"{param[0]} {param[1]}",
)
def scene_and_clip(request: pytest.FixtureRequest, asset: Find) -> tuple[Scene, Clip]:
    """A scene and one of its clips, by name, or the first."""
    file, name = request.param
    document = opened_path(asset(file)) if "." in file else opened_fixture(file)
    return reader.scene(document), clip_of(document, name)


@pytest.mark.parametrize(
    "change", mark_slow(["fewer keys", "noise", "one key", "late"], slow=["noise", "one key", "late"])
)
def test_nothing_is_understated_and_little_is_overstated(scene_and_clip: tuple[Scene, Clip], change: str) -> None:
    scene, before = scene_and_clip
    after = CHANGES[change](before)
    found = ErrorMetric(scene).error(before, after)
    truth = brute(scene, before, after, dense_times(before, after))
    noise = NOISE * diagonal(scene)
    assert found.max_error >= truth - 1e-12
    assert found.max_error <= SLACK * truth + noise
    assert found.times == len(dense_times(before, after))
    here = brute(scene, before, after, np.array([found.time]))
    assert here >= truth / SLACK - noise  # the time that is named is one of the worst


def test_the_same_clip_is_0_away(scene_and_clip: tuple[Scene, Clip]) -> None:
    scene, before = scene_and_clip
    assert ErrorMetric(scene).error(before, before).max_error <= 1e-12


def test_the_oracle_can_see() -> None:
    """The brute force itself, by hand: with the upper joint of the arm lifted by 1 m, its own vertices move by 1 m."""
    scene = reader.scene(opened_fixture("arm"))
    skin = scene.instances[0].skin
    assert skin is not None
    upper = int(skin.joints[1])
    lifted = track("translation", [0], [scene.skeleton.translation[upper] + [0, 1, 0]], node=upper)
    assert brute(scene, clip(), clip(lifted), np.zeros(1)) == pytest.approx(1)


def _fewer_keys(before: Clip) -> Clip:
    return resample(before, fps=5)


def _noise(before: Clip) -> Clip:
    return Clip(before.name, tuple(_noisy(each) for each in before.tracks))


def _noisy(made: Track) -> Track:
    values = made.values + 1e-3 * RNG.normal(size=made.values.shape)
    return replace(made, values=values)


def _one_key(before: Clip) -> Clip:
    index = max(range(len(before.tracks)), key=lambda i: len(before.tracks[i].times))
    values = before.tracks[index].values.copy()
    values[len(values) // 2, 0] += 0.01
    return with_track(before, index, replace(before.tracks[index], values=values))


def _late(before: Clip) -> Clip:
    return Clip(before.name, tuple(replace(each, time_axis=TimeAxis(each.times + 0.02)) for each in before.tracks))


CHANGES: dict[str, Callable[[Clip], Clip]] = {
    "fewer keys": _fewer_keys,
    "noise": _noise,
    "one key": _one_key,
    "late": _late,
}
