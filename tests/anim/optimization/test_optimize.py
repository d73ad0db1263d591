"""Whole documents: the bound on what was written, as read back and measured by every kind of player."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.measure.error.statistics import statistics
from anim.model import Clip, Interpolation
from anim.optimization.optimize import Optimized, optimize
from anim.optimization.options import PLAYERS as VERIFIED
from anim.optimization.options import Bounds, Drop, Objective, Packing, Policy, Request
from anim.sampling.players import PLAYERS
from anim.sampling.track import sample
from anim.sampling.weight_pointers import moved_nodes
from tests.files import glb_of, opened, opened_fixture, opened_path
from tests.khronos import errors, needs_validator, validate_many

EVERY = tuple(PLAYERS)
FIXTURES = ("arm", "biped", "interpolations", "morph_cube", "accessors", "pointer", "noop", "tube_f03", "gltf_embedded")
SMALL = ("arm", "interpolations", "morph_cube", "accessors", "pointer", "noop")


def _request(document: Document, share: float, **more: Any) -> Request:
    diagonal = ErrorMetric(reader.scene(document)).diagonal
    bounds = replace(more.pop("bounds", Bounds(0.0, 0.0)), max_error=share * diagonal, shell=0.01 * diagonal)
    return Request(bounds, **{"effort": "fast", **more})


def _optimized(document: Document, request: Request, **more: Any) -> tuple[Optimized, Document]:
    """The outcome, and its document as read back from the bytes of a file."""
    found = optimize(document, reader.scene(document), reader.clips(document), request, **more)
    return found, opened(glb_of(found.document))


def _error(before: Document, after: Document, players: Sequence[str] = EVERY) -> float:
    """The largest distance in any clip for any player, as a share of the diagonal; all clips must be there."""
    old, new = reader.clips(before), reader.clips(after)
    ruler = ErrorMetric(reader.scene(before), reader.scene(after), shell=0.01)
    worst = 0.0
    assert [each.name for each in new] == [each.name for each in old]
    for a, b in zip(old, new, strict=True):
        assert (b.start, b.end) == (a.start, a.end)
        assert b.tracks or not a.tracks
        for player in players:
            worst = max(worst, ruler.error_at(a, b, dense_times(a, b), player=player).max_error)
    return worst / (ruler.diagonal or 1.0)


def _waving() -> Document:
    """The biped with one of its clips."""
    document = opened_fixture("biped")
    (wave,) = [each for each in document.json["animations"] if each["name"] == "wave"]
    return replace(document, json={**document.json, "animations": [wave]})


@pytest.mark.parametrize("share", [1e-2, 1e-4])
@pytest.mark.parametrize("name", FIXTURES)
def test_the_bound_is_true_on_what_was_written(name: str, share: float) -> None:
    document = opened_fixture(name)
    found, written = _optimized(document, _request(document, share, policy=Policy(Drop.REST)))
    assert _error(document, written) <= share
    assert all(each.holds for each in found.verdicts.values())
    worst = max(each.error.max_error for each in found.verdicts.values())
    assert worst == pytest.approx(
        _error(document, written) * ErrorMetric(reader.scene(document)).diagonal, rel=5e-3, abs=1e-12
    )


@pytest.mark.parametrize("packing", [Packing.EXT, Packing.KHR])
@pytest.mark.parametrize("name", SMALL)
def test_the_bound_is_true_under_a_codec(name: str, packing: Packing) -> None:
    document = opened_fixture(name)
    _, written = _optimized(document, _request(document, 1e-3, packing=packing))
    assert _error(document, written) <= 1e-3


@pytest.mark.parametrize("name", FIXTURES)
def test_without_error(name: str) -> None:
    document = opened_fixture(name)
    _, written = _optimized(document, _request(document, 0.0))
    assert _error(document, written) <= 1e-9


@pytest.mark.parametrize("name", ["SimpleSkin.gltf", "RiggedSimple.gltf", "SimpleMorph.gltf", "BoxAnimated.gltf"])
def test_small_real_files(name: str, asset: Any) -> None:
    document = opened_path(asset(name))
    for share in (0.0, 1e-3):
        _, written = _optimized(document, _request(document, share))
        assert _error(document, written) <= (share or 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fox.glb", "MorphStressTest.glb"])
@pytest.mark.parametrize("packing", list(Packing))
def test_larger_real_files(name: str, packing: Packing, asset: Any) -> None:
    document = opened_path(asset(name))
    _, written = _optimized(document, _request(document, 1e-3, packing=packing))
    assert _error(document, written) <= 1e-3


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_models_of_any_size(factor: float) -> None:
    """The biped under a root that scales: the same share of its size, and about as many keys."""
    document = _waving()
    nodes = document.json["nodes"]
    (scene,) = document.json["scenes"]
    root = {"name": "root", "scale": [factor] * 3, "children": scene["nodes"]}
    scaled = replace(
        document, json={**document.json, "nodes": [*nodes, root], "scenes": [{**scene, "nodes": [len(nodes)]}]}
    )
    plain, hostile = (_optimized(each, _request(each, 1e-3)) for each in (document, scaled))
    assert _error(scaled, hostile[1]) <= 1e-3
    counts = [
        sum(len(track.times) for solution in found.solutions.values() for track in solution.clip.tracks)
        for found, _ in (plain, hostile)
    ]
    assert counts[1] == pytest.approx(counts[0], rel=0.1)


def test_the_same_bytes_for_any_number_of_processes() -> None:
    document = opened_fixture("noop")
    request = _request(document, 1e-3, packing=Packing.EXT)
    assert len(reader.clips(document)) > 2
    first, second = (glb_of(_optimized(document, request, workers=n)[0].document) for n in (1, 2))
    assert first == second


def test_the_same_request_changes_its_own_output_no_more() -> None:
    document = opened_fixture("noop")
    request = _request(document, 1e-3)
    found, written = _optimized(document, request)
    assert not found.unchanged
    again, _ = _optimized(written, request)
    assert again.unchanged
    assert again.document is written
    for other in (replace(request, packing=Packing.EXT), replace(request, objective=Objective.GZIP),
                  replace(request, bounds=replace(request.bounds, max_error=1e-4)),
                  replace(request, policy=Policy(Drop.REST)), replace(request, players=("spec",))):  # fmt: skip
        assert not _optimized(written, other)[0].unchanged


def test_clips_that_were_not_chosen_were_not_optimized() -> None:
    """Neither now, nor, as the mark in the file must know, before."""
    document = opened_fixture("biped")
    request = _request(document, 1e-2)
    found, written = _optimized(document, request, chosen=[1])
    assert list(found.solutions) == list(found.verdicts) == [1]
    for i, (a, b) in enumerate(zip(reader.clips(document), reader.clips(written), strict=True)):
        same = all(
            len(x.times) == len(y.times) and (x.values == y.values).all()
            for x, y in zip(a.tracks, b.tracks, strict=False)
        )
        assert same is (i != 1)
    assert _optimized(written, request, chosen=[1])[0].unchanged
    assert not _optimized(written, request)[0].unchanged
    assert not _optimized(written, request, chosen=[0])[0].unchanged


@pytest.mark.parametrize("share", [0.0, 1e-2])
def test_steps_stay_steps(share: float) -> None:
    document = opened_fixture("interpolations")
    _, written = _optimized(document, _request(document, share))
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
    _, written = _optimized(document, _request(document, 1e-3, packing=packing))
    weights = reader.clips(written)[0].tracks[0].values
    assert weights.min() == pytest.approx(-0.5, abs=0.01)
    assert weights.max() == pytest.approx(1.5, abs=0.01)


def test_the_rest_pose_moves_and_nothing_is_seen_of_it() -> None:
    document = _waving()
    request = _request(document, 1e-3, policy=Policy(rebase_rest=True))
    found, written = _optimized(document, request)
    assert found.moved
    assert _error(document, written) <= 1e-3
    before, after = (reader.skeleton(each) for each in (document, written))
    for node in range(len(before)):
        for path in ("translation", "rotation", "scale"):
            same = (getattr(before, path)[node] == getattr(after, path)[node]).all()
            assert same is np.bool_((node, path) not in found.moved)


def test_further_bounds() -> None:
    document = _waving()
    angle, speed = np.radians(0.05), 0.02
    for bounds in (Bounds(0.0, 0.0, max_angle=angle), Bounds(0.0, 0.0, max_speed_error=speed)):
        request = _request(document, 1e-2, bounds=bounds)
        _, written = _optimized(document, request)
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
    request = _request(document, 5e-3, bounds=Bounds(0.0, 0.0, max_pointer_error=0.5))
    found, written = _optimized(document, request)
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
    _, written = _optimized(document, _request(document, 5e-3, policy=Policy(keep=nodes)))
    new = reader.clips(written)[number].tracks[0]
    np.testing.assert_allclose(sample(new, track.times), track.values, rtol=0, atol=1e-7)


def test_a_bound_that_no_storage_keeps_leaves_the_motion_as_it_is() -> None:
    document = opened_fixture("arm")
    found, written = _optimized(document, _request(document, 1e-13))
    assert all(each.holds for each in found.verdicts.values())
    assert _error(document, written) <= 1e-9


def test_players_that_need_not_show_it_rightly() -> None:
    document = opened_fixture("noop")
    sizes = []
    for players in (("spec",), VERIFIED):
        found, written = _optimized(document, _request(document, 1e-3, players=players))
        assert _error(document, written, players) <= 1e-3
        assert {each.player for each in found.verdicts.values()} <= set(players)
        sizes.append(len(glb_of(written)))
    assert sizes[0] <= sizes[1]


def test_where_nothing_has_a_vertex_nodes_are_not_invisible() -> None:
    document = _waving()
    nodes = [{key: node[key] for key in node if key not in ("mesh", "skin")} for node in document.json["nodes"]]
    bare = replace(document, json={**document.json, "nodes": nodes})
    found, written = _optimized(bare, _request(bare, 1e-3, policy=Policy(drop_invisible=True)))
    assert all(each.holds for each in found.verdicts.values())
    assert 0 < _error(bare, written) <= 1e-3


def test_progress_goes_up_to_the_end() -> None:
    document = opened_fixture("noop")
    said: list[float] = []
    _optimized(document, _request(document, 1e-2), progress=said.append)
    assert said == sorted(said)
    assert said[-1] == 1
    assert len(said) == len(reader.clips(document))


def test_no_clips() -> None:
    document = opened_fixture("biped")
    bare = replace(document, json={key: value for key, value in document.json.items() if key != "animations"})
    found, _ = _optimized(bare, _request(bare, 1e-3))
    assert (found.solutions, found.verdicts) == ({}, {})


@pytest.mark.slow
@needs_validator
def test_the_validator_finds_no_new_errors() -> None:
    before, after, names = [], [], []
    for name in FIXTURES:
        document = opened_fixture(name)
        for packing in Packing if name != "biped" else (Packing.EXT,):
            _, written = _optimized(document, _request(document, 1e-3, packing=packing, policy=Policy(Drop.REST)))
            before.append(glb_of(document))
            after.append(glb_of(written))
            names.append((name, packing))
    reports = validate_many([*before, *after])
    for which, old, new in zip(names, reports[: len(names)], reports[len(names) :], strict=True):
        assert set(errors(new)) <= set(errors(old)), which


def _tracks(clip: Clip) -> int:
    return len(clip.tracks)


def test_policies_on_a_file_with_rests() -> None:
    """`noop` has a clip that never leaves rest, and tracks that do nothing in one clip only."""
    document = opened_fixture("noop")
    counts = {}
    for drop in Drop:
        _, written = _optimized(document, _request(document, 1e-4, policy=Policy(drop)))
        counts[drop] = [_tracks(each) for each in reader.clips(written)]
        assert _error(document, written) <= 1e-4
    source = [_tracks(each) for each in reader.clips(document)]
    assert counts[Drop.NEVER] == source
    assert sum(counts[Drop.REST]) < sum(counts[Drop.UNUSED]) < sum(source)
    assert min(counts[Drop.REST]) >= 1


@pytest.mark.parametrize("name", ["morph_cube", "arm", "noop", "biped"])
def test_more_room_never_takes_more_bytes_than_none(name: str) -> None:
    """Splines of few keys are hard to beat by lines: what lossless storage makes of them must not be forgotten."""
    document = opened_fixture(name)
    exact, loose = (len(glb_of(_optimized(document, _request(document, share))[1])) for share in (0.0, 1e-2))
    assert loose <= exact
