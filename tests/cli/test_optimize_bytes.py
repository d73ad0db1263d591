"""`optimize --max-bytes`: the smallest error that fits."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.io import container
from anim.optimization import byte_limit, stepwise_limit
from anim.optimization.file_optimizer import FileOptimizer
from anim.optimization.optimize import Optimized
from anim.optimization.options import EFFORTS, Effort, Request
from fixtures.broken.pieces import buffered, glb
from tests.cli.comparing import apart
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import refusal

FAST = ("--effort", "fast")


def test_the_smallest_error_that_fits(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source = fixture("noop")
    found = {}
    for percent in ("0", "0.01%", "1%"):
        path = tmp_path / "any.glb"
        assert call("optimize", source, path, "--max-error", percent, *FAST).code == 0
        found[percent] = path.stat().st_size
    limit = (found["0.01%"] + found["1%"]) // 2
    run = call("optimize", source, tmp_path / "fits.glb", "--max-bytes", f"{limit / 1000}kB", "--report", "-", *FAST)
    assert run.code == 0, run.err
    assert (tmp_path / "fits.glb").stat().st_size <= limit
    assert "the smallest error found that fits --max-bytes" in run.err
    error = max(each["max_error_m"] for each in run.json["clips"])
    assert 0 < error <= 0.011 * run.json["diagonal_m"]
    roomy = call("optimize", source, tmp_path / "r.glb", "--max-bytes", str(found["0"] + 100), "--report", "-", *FAST)
    assert max(each["max_error_m"] for each in roomy.json["clips"]) <= 1e-9 * roomy.json["diagonal_m"]


def test_a_search_that_ends_elsewhere_still_fits(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sizes are tried fast; here the longer search does worse, as chance may have it."""
    assert call("optimize", fixture("noop"), tmp_path / "any.glb", "--max-error", "0.1%", *FAST).code == 0
    limit = (tmp_path / "any.glb").stat().st_size
    monkeypatch.setitem(EFFORTS, "balanced", Effort(1, finishing=()))
    assert call("optimize", fixture("noop"), tmp_path / "out.glb", "--max-bytes", str(limit)).code == 0
    assert (tmp_path / "out.glb").stat().st_size <= limit
    assert call("optimize", tmp_path / "out.glb", tmp_path / "again.glb", "--max-bytes", str(limit)).code == 0
    assert (tmp_path / "again.glb").read_bytes() == (tmp_path / "out.glb").read_bytes()


def test_one_full_search_with_verification(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All sizes before it come from fast searches whose errors are not measured; small files are searched more."""
    monkeypatch.setattr(stepwise_limit, "MAX_VALUES", 0)
    searched = _count_searches(monkeypatch)
    source, output = fixture("noop"), tmp_path / "out.glb"
    assert call("optimize", source, output, "--max-bytes", "5550").code == 0
    assert output.stat().st_size <= 5550
    clips = len(container.read(source.read_bytes()).json["animations"])
    assert [count for effort, verified, count in searched if verified] == [clips]
    assert {effort for effort, verified, _ in searched if not verified} == {"fast"}
    assert len(searched) <= 9


@pytest.mark.parametrize("percent", ["0.02", "0.3"])
def test_many_clips_are_searched_little_more_than_once(
    percent: str, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sample comes first; the others' bounds follow from its bytes, and the bytes too many from a few clips."""
    source, at_bound, output = tmp_path / "in.glb", tmp_path / "bound.glb", tmp_path / "out.glb"
    source.write_bytes(_swaying_clips(24))
    assert call("optimize", source, at_bound, "--max-error", f"{percent}%").code == 0
    limit = at_bound.stat().st_size
    searched = _count_searches(monkeypatch)
    run = call("optimize", source, output, "--max-bytes", str(limit), "--report", "-")
    assert output.stat().st_size <= limit
    verified = [count for effort, is_verified, count in searched if is_verified and effort == "balanced"]
    assert verified[0] == 4
    assert sum(verified) <= 2 * 24
    assert apart(call, source, output)["max_error_percent"] <= 1.6 * float(percent)
    assert max(each["max_error_m"] for each in run.json["clips"]) > 0
    assert call("optimize", output, tmp_path / "again.glb", "--max-bytes", str(limit)).code == 0
    assert (tmp_path / "again.glb").read_bytes() == output.read_bytes()


@pytest.mark.parametrize("percent", ["0.05", "0.7", "3"])
def test_what_many_clips_take_at_the_ceiling_fits(percent: str, tmp_path: Path, call: Call) -> None:
    """Some of them reach it first: the others are searched there too before the limit is refused."""
    source, at_bound, output = tmp_path / "in.glb", tmp_path / "bound.glb", tmp_path / "out.glb"
    source.write_bytes(_swaying_clips(24))
    assert call("optimize", source, at_bound, "--max-error", f"{percent}%").code == 0
    limit = at_bound.stat().st_size
    ceiling = ("--max-error", f"{percent}%", "--max-bytes", str(limit))
    assert call("optimize", source, output, *ceiling, "--jobs", "2").code == 0
    assert output.stat().st_size <= limit
    assert apart(call, source, output)["max_error_percent"] <= float(percent)
    call("optimize", source, tmp_path / "one.glb", *ceiling, "--jobs", "1").product()
    assert (tmp_path / "one.glb").read_bytes() == output.read_bytes()


def test_equal_clips_stay_equal(tmp_path: Path, call: Call) -> None:
    """They share their data, so that one search of each is enough, at one bound."""
    source, at_bound, output = tmp_path / "in.glb", tmp_path / "bound.glb", tmp_path / "out.glb"
    source.write_bytes(_swaying_clips(14, repeated=3))
    assert call("optimize", source, at_bound, "--max-error", "0.05%").code == 0
    limit = at_bound.stat().st_size
    assert call("optimize", source, output, "--max-bytes", str(limit)).code == 0
    assert output.stat().st_size <= limit
    assert apart(call, source, output)["max_error_percent"] <= 0.08
    clips = container.read(output.read_bytes()).json["animations"]
    assert [each["samplers"] for each in clips[:14]] == [each["samplers"] for each in clips[14:28]]


@pytest.mark.parametrize("limit", ["100", "100MB"])
def test_a_model_of_infinite_size_is_refused(limit: str, tmp_path: Path, call: Call) -> None:
    nodes = [{"name": f"n{i}", "scale": [1e38] * 3, "children": [i + 1]} for i in range(12)]
    times, turns = ("SCALAR", 5126, [0, 1]), ("VEC4", 5126, [[0, 0, 0, 1], [0, 0, 1, 0]])
    clip = {
        "samplers": [{"input": 0, "output": 1}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
    }
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "animations": [clip]}
    document |= {"nodes": [*nodes, {"name": "end", "translation": [1, 0, 0]}], **buffered(times, turns)}
    (tmp_path / "in.glb").write_bytes(glb(json.dumps(document).encode()))
    run = call("optimize", tmp_path / "in.glb", tmp_path / "out.glb", "--max-bytes", limit)
    assert (run.code, "its diagonal is infinite" in run.err) == (3, True), run.err


def test_many_clips_of_a_model_without_size(tmp_path: Path, call: Call) -> None:
    source = tmp_path / "in.glb"
    source.write_bytes(_swaying_clips(13, mesh=False))
    limit = str(source.stat().st_size // 2)
    for options in ((), ("--max-error", "1mm")):
        run = call("optimize", source, tmp_path / "out.glb", "--max-bytes", limit, *options)
        assert run.code == (0 if options else 6), run.err


def _count_searches(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, bool, int]]:
    """Effort, whether errors are measured, and number of clips of each search from now on."""
    searched: list[tuple[str, bool, int]] = []
    run, search = FileOptimizer.run, FileOptimizer.search

    def counted(file: FileOptimizer, request: Request, **options: Any) -> Optimized:
        if not options.get("earlier"):
            searched.append((request.effort, options.get("verified", True), len(file.chosen)))
        return run(file, request, **options)

    def counted_some(file: FileOptimizer, request: Request, chosen: Sequence[int], **options: Any) -> Any:
        searched.append((request.effort, options.get("verified", True), len(chosen)))
        return search(file, request, chosen, **options)

    monkeypatch.setattr(FileOptimizer, "run", counted)
    monkeypatch.setattr(FileOptimizer, "search", counted_some)
    return searched


def _swaying_clips(count: int, *, repeated: int = 1, mesh: bool = True) -> bytes:
    """A triangle that sways about an axis, in many clips of 60 keys, each with other waves, all so many times."""
    times = np.arange(60) / 30
    chosen = np.random.default_rng(7)
    angles = sum(
        chosen.uniform(0.1, 0.6, (count, 1)) * np.sin(times * rate + chosen.uniform(0, 6, (count, 1))) / rate
        for rate in (2, 5, 11, 23)
    )
    zeros = np.zeros_like(angles)
    keys = np.stack([zeros, zeros, np.sin(angles / 2), np.cos(angles / 2)], axis=-1)
    corners = ("VEC3", 5126, np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    arrays = buffered(("SCALAR", 5126, times), corners, *[("VEC4", 5126, each) for each in keys])
    channels = [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}]
    clips = [
        {"name": f"c{i}", "samplers": [{"input": 0, "output": 2 + i % count}], "channels": channels}
        for i in range(repeated * count)
    ]
    nodes = {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": "a", **({"mesh": 0} if mesh else {})}]}
    meshes = {"meshes": [{"primitives": [{"attributes": {"POSITION": 1}}]}]}
    return glb(json.dumps({"asset": {"version": "2.0"}, **nodes, **meshes, **arrays, "animations": clips}).encode())


def test_unused_bytes_are_worth_another_search(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where sizes jump, the first bound that fits can be far from the smallest."""
    errors = []
    for searches in (0, 3):
        monkeypatch.setattr(byte_limit, "MAX_REFINEMENTS", searches)
        output = tmp_path / f"{searches}.glb"
        run = call("optimize", fixture("noop"), output, "--max-bytes", "5600", "--report", "-", *FAST)
        assert output.stat().st_size <= 5600
        errors.append(max(each["max_error_m"] for each in run.json["clips"]))
    assert errors[1] <= errors[0]


def test_small_files_have_the_smallest_error_around_a_limit(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sizes rise and fall with the bound: one that didn't fit hid smaller ones that do."""
    errors = {}
    for most in (0, 20_000):
        monkeypatch.setattr(stepwise_limit, "MAX_VALUES", most)
        for limit in (5350, 5450, 5600, 5800):
            output = tmp_path / "out.glb"
            run = call("optimize", fixture("noop"), output, "--max-bytes", str(limit), "--report", "-", *FAST)
            assert output.stat().st_size <= limit
            errors[most, limit] = max(each["max_error_m"] for each in run.json["clips"])
    found = [errors[20_000, limit] for limit in (5350, 5450, 5600, 5800)]
    assert found == sorted(found, reverse=True)
    assert all(errors[20_000, limit] <= errors[0, limit] for limit in (5350, 5450, 5600, 5800))


@pytest.mark.slow
def test_real_files_have_less_error_for_more_bytes(asset: Find, tmp_path: Path, call: Call) -> None:
    for name, limits in {"Fox.glb": (128, 129, 130, 132, 137), "CesiumMan.glb": (436, 438, 440, 442, 445)}.items():
        errors = []
        for limit in limits:
            run = call("optimize", asset(name), tmp_path / "a.glb", "--max-bytes", f"{limit}kB", "--report", "-")
            errors.append(max(each["max_error_m"] for each in run.json["clips"]))
        assert errors == sorted(errors, reverse=True)
        if name == "Fox.glb":
            assert errors[2] < 0.75  # at 130 kB; --max-error 0.44% fits too


def test_what_the_whole_search_reaches_fits(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """Also below what a fast search reaches, by which sizes are estimated."""
    sizes = {}
    for effort in ("fast", "balanced"):
        path = tmp_path / f"{effort}.glb"
        assert call("optimize", fixture("noop"), path, "--max-error", "0.5%", "--effort", effort).code == 0
        sizes[effort] = path.stat().st_size
    assert sizes["balanced"] < sizes["fast"]
    limit = str(sizes["balanced"])
    run = call("optimize", fixture("noop"), tmp_path / "out.glb", "--max-error", "0.5%", "--max-bytes", limit)
    assert run.code == 0, run.err
    assert (tmp_path / "out.glb").stat().st_size <= sizes["balanced"]


def test_a_model_without_size(tmp_path: Path, call: Call) -> None:
    times = np.arange(30) / 30
    arrays = buffered(("SCALAR", 5126, times), ("VEC3", 5126, np.outer(np.sin(7 * times), [0, 1, 0])))
    channels = [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]
    clip = {"name": "rise", "samplers": [{"input": 0, "output": 1}], "channels": channels}
    nodes = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": "a"}]}
    source = tmp_path / "node.glb"
    source.write_bytes(glb(json.dumps({**nodes, **arrays, "animations": [clip]}).encode()))
    for limit in (source.stat().st_size - 200, 100):
        run = call("optimize", source, tmp_path / "out.glb", "--max-error", "5mm", "--max-bytes", str(limit), *FAST)
        assert (run.code, "bug" in run.err) in ((0, False), (6, False)), run.err


def test_a_bound_whose_share_of_the_model_is_beyond_all_numbers(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    options = ("--max-error", "1e308m", "--max-bytes", "100", *FAST)
    said = refusal(call("optimize", fixture("arm"), tmp_path / "out.glb", *options), 6)
    assert "with an error of up to 1e+308 m it still takes" in said


def test_too_few_bytes(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("arm"), tmp_path / "out.glb", "--max-bytes", "100", *FAST)
    assert "doesn't fit 100 bytes" in refusal(run, 6)
    assert not (tmp_path / "out.glb").exists()
    still = int(re.findall(r"still takes (\d+) bytes", run.err)[0])
    assert call("optimize", fixture("arm"), tmp_path / "out.glb", "--max-error", "10%", *FAST).code == 0
    assert (tmp_path / "out.glb").stat().st_size == still


@pytest.mark.slow
def test_bytes_and_error_both_count(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """The size at the bound itself fits, a byte less does not, though a larger error would do."""
    at_bound, output = tmp_path / "bound.glb", tmp_path / "out.glb"
    bound = ("--max-error", "0.01%", "--clip", "wave", *FAST)
    assert call("optimize", fixture("biped"), at_bound, *bound).code == 0
    limit = at_bound.stat().st_size
    assert call("optimize", fixture("biped"), output, "--max-bytes", str(limit), *bound).code == 0
    assert output.stat().st_size <= limit
    assert apart(call, fixture("biped"), output)["max_error_percent"] <= 0.01
    roomy = call("optimize", fixture("biped"), tmp_path / "no.glb", "--max-bytes", str(limit - 1), *bound[2:])
    assert roomy.code == 0, roomy.err
    (tmp_path / "no.glb").unlink()
    tight = call("optimize", fixture("biped"), tmp_path / "no.glb", "--max-bytes", str(limit - 1), *bound)
    assert f"doesn't fit {limit - 1} bytes" in refusal(tight, 6)
    assert not (tmp_path / "no.glb").exists()


@pytest.mark.slow
def test_the_size_at_the_bound_fits_for_many_clips_too(asset: Find, tmp_path: Path, call: Call) -> None:
    """Results of several searches share less than those of one: this size was refused."""
    at_bound, output = tmp_path / "bound.glb", tmp_path / "out.glb"
    assert call("optimize", asset("Robot.glb"), at_bound, "--max-error", "1mm").code == 0
    limit = at_bound.stat().st_size
    run = call("optimize", asset("Robot.glb"), output, "--max-error", "1mm", "--max-bytes", str(limit))
    assert run.code == 0, run.err
    assert output.stat().st_size <= limit
