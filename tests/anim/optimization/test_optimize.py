"""Whole documents: the bound on what was written, as read back and measured by every kind of player."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from anim.optimization import clip_batches
from anim.optimization.options import PLAYERS as VERIFIED
from anim.optimization.options import Drop, Objective, Packing, Policy
from tests.anim.optimization.optimizing import error, optimized, request_for, waving
from tests.files import glb_of, opened_fixture, opened_path
from tests.khronos import errors, needs_validator, validate_many

FIXTURES = ("arm", "biped", "interpolations", "morph_cube", "accessors", "pointer", "noop", "tube_f03", "gltf_embedded")
SMALL = ("arm", "interpolations", "morph_cube", "accessors", "pointer", "noop")


@pytest.mark.parametrize("share", [1e-2, 1e-4])
@pytest.mark.parametrize("name", FIXTURES)
def test_the_bound_is_true_on_what_was_written(name: str, share: float) -> None:
    document = opened_fixture(name)
    found, written = optimized(document, request_for(document, share, policy=Policy(Drop.REST)))
    assert error(document, written) <= share
    assert all(each.holds for each in found.verdicts.values())
    worst = max(each.error.max_error for each in found.verdicts.values())
    assert worst == pytest.approx(
        error(document, written) * ErrorMetric(reader.scene(document)).diagonal, rel=5e-3, abs=1e-12
    )


@pytest.mark.parametrize("packing", [Packing.EXT, Packing.KHR])
@pytest.mark.parametrize("name", SMALL)
def test_the_bound_is_true_under_a_codec(name: str, packing: Packing) -> None:
    document = opened_fixture(name)
    _, written = optimized(document, request_for(document, 1e-3, packing=packing))
    assert error(document, written) <= 1e-3


@pytest.mark.parametrize("name", FIXTURES)
def test_without_error(name: str) -> None:
    document = opened_fixture(name)
    _, written = optimized(document, request_for(document, 0.0))
    assert error(document, written) <= 1e-9


@pytest.mark.parametrize("name", ["SimpleSkin.gltf", "RiggedSimple.gltf", "SimpleMorph.gltf", "BoxAnimated.gltf"])
def test_small_real_files(name: str, asset: Any) -> None:
    document = opened_path(asset(name))
    for share in (0.0, 1e-3):
        _, written = optimized(document, request_for(document, share))
        assert error(document, written) <= (share or 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fox.glb", "MorphStressTest.glb"])
@pytest.mark.parametrize("packing", list(Packing))
def test_larger_real_files(name: str, packing: Packing, asset: Any) -> None:
    document = opened_path(asset(name))
    _, written = optimized(document, request_for(document, 1e-3, packing=packing))
    assert error(document, written) <= 1e-3


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_models_of_any_size(factor: float) -> None:
    """The biped under a root that scales: the same share of its size, and about as many keys."""
    document = waving()
    nodes = document.json["nodes"]
    (scene,) = document.json["scenes"]
    root = {"name": "root", "scale": [factor] * 3, "children": scene["nodes"]}
    scaled = replace(
        document, json={**document.json, "nodes": [*nodes, root], "scenes": [{**scene, "nodes": [len(nodes)]}]}
    )
    plain, hostile = (optimized(each, request_for(each, 1e-3)) for each in (document, scaled))
    assert error(scaled, hostile[1]) <= 1e-3
    counts = [
        sum(len(track.times) for solution in found.solutions.values() for track in solution.clip.tracks)
        for found, _ in (plain, hostile)
    ]
    assert counts[1] == pytest.approx(counts[0], rel=0.1)


def test_the_same_bytes_for_any_number_of_processes() -> None:
    document = opened_fixture("noop")
    request = request_for(document, 1e-3, packing=Packing.EXT)
    assert len(reader.clips(document)) > 2
    first, second = (glb_of(optimized(document, request, workers=n)[0].document) for n in (1, 2))
    assert first == second


def test_the_same_request_changes_its_own_output_no_more() -> None:
    document = opened_fixture("noop")
    request = request_for(document, 1e-3)
    found, written = optimized(document, request)
    assert not found.unchanged
    again, _ = optimized(written, request)
    assert again.unchanged
    assert again.document is written
    for other in (replace(request, packing=Packing.EXT), replace(request, objective=Objective.GZIP),
                  replace(request, bounds=replace(request.bounds, max_error=1e-4)),
                  replace(request, policy=Policy(Drop.REST)), replace(request, players=("spec",))):  # fmt: skip
        assert not optimized(written, other)[0].unchanged


def test_clips_that_were_not_chosen_were_not_optimized() -> None:
    """Neither now, nor, as the mark in the file must know, before."""
    document = opened_fixture("biped")
    request = request_for(document, 1e-2)
    found, written = optimized(document, request, chosen=[1])
    assert list(found.solutions) == list(found.verdicts) == [1]
    for i, (a, b) in enumerate(zip(reader.clips(document), reader.clips(written), strict=True)):
        same = all(
            len(x.times) == len(y.times) and (x.values == y.values).all()
            for x, y in zip(a.tracks, b.tracks, strict=False)
        )
        assert same is (i != 1)
    assert optimized(written, request, chosen=[1])[0].unchanged
    assert not optimized(written, request)[0].unchanged
    assert not optimized(written, request, chosen=[0])[0].unchanged


def test_players_that_need_not_show_it_rightly() -> None:
    document = opened_fixture("noop")
    sizes = []
    for players in (("spec",), VERIFIED):
        found, written = optimized(document, request_for(document, 1e-3, players=players))
        assert error(document, written, players) <= 1e-3
        assert {each.player for each in found.verdicts.values()} <= set(players)
        sizes.append(len(glb_of(written)))
    assert sizes[0] <= sizes[1]


def test_where_nothing_has_a_vertex_nodes_are_not_invisible() -> None:
    document = waving()
    nodes = [{key: node[key] for key in node if key not in ("mesh", "skin")} for node in document.json["nodes"]]
    bare = replace(document, json={**document.json, "nodes": nodes})
    found, written = optimized(bare, request_for(bare, 1e-3, policy=Policy(drop_invisible=True)))
    assert all(each.holds for each in found.verdicts.values())
    assert 0 < error(bare, written) <= 1e-3


def test_progress_goes_up_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clip_batches, "BATCH_KEYS", 0)  # one batch for each clip
    document = opened_fixture("noop")
    said: list[float] = []
    optimized(document, request_for(document, 1e-2), progress=said.append)
    assert said == sorted(said)
    assert said[-1] == 1
    assert len(said) == len(reader.clips(document))


def test_no_clips() -> None:
    document = opened_fixture("biped")
    bare = replace(document, json={key: value for key, value in document.json.items() if key != "animations"})
    found, _ = optimized(bare, request_for(bare, 1e-3))
    assert (found.solutions, found.verdicts) == ({}, {})


@pytest.mark.slow
@needs_validator
def test_the_validator_finds_no_new_errors() -> None:
    before, after, names = [], [], []
    for name in FIXTURES:
        document = opened_fixture(name)
        for packing in Packing if name != "biped" else (Packing.EXT,):
            _, written = optimized(document, request_for(document, 1e-3, packing=packing, policy=Policy(Drop.REST)))
            before.append(glb_of(document))
            after.append(glb_of(written))
            names.append((name, packing))
    reports = validate_many([*before, *after])
    for which, old, new in zip(names, reports[: len(names)], reports[len(names) :], strict=True):
        assert set(errors(new)) <= set(errors(old)), which


@pytest.mark.parametrize("name", ["morph_cube", "arm", "noop", "biped"])
def test_more_room_never_takes_more_bytes_than_none(name: str) -> None:
    """Splines of few keys are hard to beat by lines: what lossless storage makes of them must not be forgotten."""
    document = opened_fixture(name)
    exact, loose = (len(glb_of(optimized(document, request_for(document, share))[1])) for share in (0.0, 1e-2))
    assert loose <= exact
