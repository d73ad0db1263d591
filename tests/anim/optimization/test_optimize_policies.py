"""What optimize leaves as it is: steps, weights, rest poses, kept nodes, further bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.statistics import statistics
from anim.model import Clip, Interpolation
from anim.optimization.options import Bounds, Drop, Packing, Policy
from anim.sampling.track import sample
from anim.sampling.weight_pointers import moved_nodes
from tests.anim.optimization.optimizing import error, optimized, request_for, waving
from tests.files import opened_fixture


@pytest.mark.parametrize("share", [0.0, 1e-2])
def test_steps_stay_steps(share: float) -> None:
    document = opened_fixture("interpolations")
    _, written = optimized(document, request_for(document, share))
    old, new = (reader.clips(each)[0] for each in (document, written))
    steps = {track.target: track for track in old.tracks if track.interpolation is Interpolation.STEP}
    found = {track.target: track for track in new.tracks if track.interpolation is Interpolation.STEP}
    assert len(steps) == 3
    assert list(found) == list(steps)
    for target, track in steps.items():
        changes = np.r_[True, (np.diff(track.values, axis=0) != 0).any(axis=1)]
        assert set(track.times[changes]) <= set(found[target].times)


@pytest.mark.parametrize("packing", list(Packing))
def test_weights_are_not_clamped(packing: Packing) -> None:
    document = opened_fixture("morph_cube")
    _, written = optimized(document, request_for(document, 1e-3, packing=packing))
    weights = reader.clips(written)[0].tracks[0].values
    assert weights.min() == pytest.approx(-0.5, abs=0.01)
    assert weights.max() == pytest.approx(1.5, abs=0.01)


def test_the_rest_pose_moves_and_nothing_is_seen_of_it() -> None:
    document = waving()
    request = request_for(document, 1e-3, policy=Policy(rebase_rest=True))
    found, written = optimized(document, request)
    assert found.moved
    assert error(document, written) <= 1e-3
    before, after = (reader.skeleton(each) for each in (document, written))
    for node in range(len(before)):
        for path in ("translation", "rotation", "scale"):
            same = (getattr(before, path)[node] == getattr(after, path)[node]).all()
            assert same is np.bool_((node, path) not in found.moved)


def test_further_bounds() -> None:
    document = waving()
    angle, speed = np.radians(0.05), 0.02
    for bounds in (Bounds(0.0, 0.0, max_angle=angle), Bounds(0.0, 0.0, max_speed_error=speed)):
        request = request_for(document, 1e-2, bounds=bounds)
        _, written = optimized(document, request)
        ruler = ErrorMetric(reader.scene(document))
        for a, b in zip(reader.clips(document), reader.clips(written), strict=True):
            about = statistics(ruler, a, b)
            if bounds.max_angle is not None:
                assert about.angle.size <= angle
            else:
                assert about.speed.size <= speed


def test_morph_weights_by_pointers_have_the_bound_of_vertices() -> None:
    """Whatever the bound of other pointers is: weights of a node's cube, of up to 0.25 m."""
    document = opened_fixture("pointer")
    clips = reader.clips(document)
    number = next(i for i, each in enumerate(clips) if each.name == "one_weight")
    times = np.arange(40) / 30
    values = np.sin(times * 5)[:, None] * 0.5 + 0.5
    track = clips[number].tracks[0].with_keys(times, values)
    document = writer.replace_clips(document, {number: replace(clips[number], tracks=(track,))})
    request = request_for(document, 5e-3, bounds=Bounds(0.0, 0.0, max_pointer_error=0.5))
    found, written = optimized(document, request)
    new = reader.clips(written)[number].tracks[0]
    assert new.pointer == track.pointer
    assert len(new.times) < len(times) / 2
    at = np.linspace(0, times[-1], 999)
    apart = 0.25 * float(np.abs(sample(new, at) - sample(track, at)).max())
    assert 1e-3 < apart <= request.bounds.max_error
    assert found.verdicts[number].error.max_error == pytest.approx(apart, rel=0.05)


def test_kept_nodes_keep_morph_weights_by_pointers() -> None:
    document = opened_fixture("pointer")
    clips = reader.clips(document)
    number = next(i for i, each in enumerate(clips) if each.name == "one_weight")
    times = np.arange(40) / 30
    track = clips[number].tracks[0].with_keys(times, np.sin(times * 5)[:, None] * 0.5 + 0.5)
    document = writer.replace_clips(document, {number: replace(clips[number], tracks=(track,))})
    track = reader.clips(document)[number].tracks[0]  # as stored
    nodes = frozenset(moved_nodes(reader.skeleton(document), track))
    assert nodes
    _, written = optimized(document, request_for(document, 5e-3, policy=Policy(keep=nodes)))
    new = reader.clips(written)[number].tracks[0]
    np.testing.assert_allclose(sample(new, track.times), track.values, rtol=0, atol=1e-7)


def test_a_bound_that_no_storage_keeps_leaves_the_motion_as_it_is() -> None:
    document = opened_fixture("arm")
    found, written = optimized(document, request_for(document, 1e-13))
    assert all(each.holds for each in found.verdicts.values())
    assert error(document, written) <= 1e-9


def _tracks(clip: Clip) -> int:
    return len(clip.tracks)


def test_policies_on_a_file_with_rests() -> None:
    """`noop` has a clip that never leaves rest, and tracks that do nothing in one clip only."""
    document = opened_fixture("noop")
    counts = {}
    for drop in Drop:
        _, written = optimized(document, request_for(document, 1e-4, policy=Policy(drop)))
        counts[drop] = [_tracks(each) for each in reader.clips(written)]
        assert error(document, written) <= 1e-4
    source = [_tracks(each) for each in reader.clips(document)]
    assert counts[Drop.NEVER] == source
    assert sum(counts[Drop.REST]) < sum(counts[Drop.UNUSED]) < sum(source)
    assert min(counts[Drop.REST]) >= 1
