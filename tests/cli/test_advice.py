"""What `inspect` advises is a command line that runs, and after it the finding is gone."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.writing import writer
from tests import clips
from tests.cli.conftest import Call, Find
from tests.cli.inspecting import Json, only
from tests.cli.running import built
from tests.files import glb_of, opened, opened_path

COMMAND = re.compile(r"gltf-anim (\S+) IN OUT\b(.*)$")
NO_COMMAND = {"missing-file", "unknown-extension", "ignored-channels", "duplicate-clip-names"}  # say why, or what else
REDUNDANT = "redundant-keys"  # fewer then; what a bound on vertices needs stays
QUICK = {"optimize": ["--effort", "fast"]}  # the same result where channels go; only the search is shorter


def follow(call: Call, path: Path) -> set[str]:
    """Run every command line that the findings on a file advise; return the names of those that had one.

    After each the file is inspected again: the finding must be gone. Findings without a line must say where to act.
    """
    followed: set[str] = set()
    output = path.with_name("advised.glb")
    for finding in only(call, path)["findings"]:
        line = COMMAND.search(finding["advice"])
        if line is None:
            assert finding["name"] in NO_COMMAND or "made" in finding["advice"], finding
            continue
        command, options = line.group(1), shlex.split(line.group(2))
        call(command, path, output, *options, *QUICK.get(command, [])).product()
        left = {each["name"] for each in only(call, output)["findings"]}
        assert finding["name"] not in left - {REDUNDANT}, finding
        followed.add(finding["name"])
    return followed


@pytest.mark.parametrize("options", [(), ("--param", "GA102.angle=10")])
def test_keys_for_nlerp_are_added_at_once(options: tuple[str, ...], call: Call, tmp_path: Path) -> None:
    """A step of 170° was advised another half as long, and after that one a quarter."""
    path = tmp_path / "in.glb"
    turn = clips.track("rotation", [0, 0.5, 0.51, 1.3], clips.about("x", [0, 170, 10, 40]), clips.LINEAR, node=0)
    path.write_bytes(glb_of(writer.replace_clips(opened(built("biped")), {0: clips.clip(turn)})))
    check = ("check", path, "--select", "GA102", *options, "--format", "json")
    (finding,) = [each for each in call(*check).json["findings"] if each["pointer"].startswith("/animations/0")]
    line = finding["advice"].split("gltf-anim ")[1]
    assert call(*(str(path) if word == "FILE" else word for word in shlex.split(line))).code == 0
    assert call(*check).json["findings"] == []


def test_advice_for_a_player_runs(call: Call, tmp_path: Path) -> None:
    source, output = tmp_path / "in.glb", tmp_path / "out.glb"
    source.write_bytes(built("interpolations"))
    options = ("--target", "quick-look", "--select", "GA503", "--format", "json")
    first, second = call("check", source, *options).json["findings"]
    assert (first["problem"], second["advice"]) == (
        "CUBICSPLINE is not supported",
        "leave it out where the file is made",
    )
    line = COMMAND.search(first["advice"])
    assert line is not None
    assert "--fps 60 " in first["advice"]  # the splines have a key or two a second, which is too few for lines
    call(line.group(1), source, output, *shlex.split(line.group(2))).product()
    assert call("check", output, *options).json["findings"] == []


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (
            "noop",
            {"non-unit-rotations", "wide-steps", "sign-flips", "no-effect-tracks", "late-start", "end-frame"},
        ),
        ("biped", {"no-effect-tracks", "constant-tracks"}),
        ("tube", set()),
    ],
)
def test_fixtures(name: str, expected: set[str], call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.glb"
    path.write_bytes(built(name))
    assert follow(call, path) - {REDUNDANT} == expected


def _without_bounds(json: Json) -> None:
    for animation in json["animations"]:
        for sampler in animation["samplers"]:
            for key in ("min", "max"):
                json["accessors"][sampler["input"]].pop(key, None)


def _with_idle_samplers(json: Json) -> None:
    for animation in json["animations"]:
        animation["samplers"].append(dict(animation["samplers"][0]))


def _with_strides(json: Json) -> None:
    sizes = {"SCALAR": 4, "VEC3": 12, "VEC4": 16}
    for animation in json["animations"]:
        for sampler in animation["samplers"]:
            output = json["accessors"][sampler["output"]]
            if output["componentType"] == 5126:
                json["bufferViews"][output["bufferView"]]["byteStride"] = sizes[output["type"]]


@pytest.mark.parametrize(
    ("spoil", "finding"),
    [
        (_without_bounds, "missing-bounds"),
        (_with_idle_samplers, "unused-samplers"),
        (_with_strides, "strided-animation"),
    ],
)
def test_badly_stored_keys_are_written_anew(
    spoil: Callable[[Any], None], finding: str, call: Call, tmp_path: Path
) -> None:
    document = opened(built("interpolations"))
    spoil(document.json)
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(document))
    assert finding in follow(call, path)


def test_keys_on_no_grid_are_not_advised_by_their_closest_ones(call: Call, tmp_path: Path) -> None:
    """Random keys, some 2 ms apart: the rate in the advice is a usual one."""
    times = np.sort(np.random.default_rng(3).uniform(0, 0.1, 40))
    signs = np.where(np.arange(40) % 7 == 0, -1.0, 1.0)[:, None]
    turning = clips.track("rotation", times, signs * clips.about("y", np.linspace(0, 90, 40)))
    document = writer.replace_clips(opened(built("gltf_embedded")), {0: clips.clip(turning, name="slide")})
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(document))
    (finding,) = (each for each in only(call, path)["findings"] if each["name"] == "sign-flips")
    assert "--fps 60 " in finding["advice"]


def test_splines_that_turn_the_long_way(call: Call, tmp_path: Path) -> None:
    values = np.array([[0, 0, 0, 1], [0, 0.1, 0, -0.995], [0, 0.2, 0, 0.98]])
    zero = np.zeros((3, 4))
    turning = clips.track("rotation", [0, 1, 2], values, clips.CUBICSPLINE, tangents=(zero, zero))
    document = writer.replace_clips(opened(built("gltf_embedded")), {0: clips.clip(turning, name="slide")})
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(document))
    assert follow(call, path) >= {"sign-flips-in-splines"}


def _still(count: int) -> Any:
    return clips.track("scale", np.arange(count), np.full((count, 3), 2.0))


@pytest.mark.parametrize(("count", "found"), [(1, False), (5, True)])
def test_constant_tracks_are_those_of_several_keys(count: int, found: bool, call: Call, tmp_path: Path) -> None:
    moving = clips.track("translation", [0, 1, 5], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    document = writer.replace_clips(
        opened(built("gltf_embedded")), {0: clips.clip(moving, _still(count), name="slide")}
    )
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(document))
    assert ("constant-tracks" in follow(call, path)) is found


def test_a_track_that_holds_the_end_of_its_clip_is_needed(call: Call, tmp_path: Path) -> None:
    document = writer.replace_clips(opened(built("gltf_embedded")), {0: clips.clip(_still(2), name="slide")})
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(document))
    assert "constant-tracks" not in {each["name"] for each in only(call, path)["findings"]}


def test_keys_that_hold_are_never_on_the_way(call: Call, tmp_path: Path) -> None:
    """A STEP track jumps from pose to pose: no player looks for a way between, however signs and angles lie."""
    values = np.array([[0, 0, 0, 1], [0, 1, 0, -1e-3], [0, 0, 0, -1]])
    jumping = clips.track("rotation", [0, 1, 2], values, clips.STEP)
    document = writer.replace_clips(opened(built("gltf_embedded")), {0: clips.clip(jumping, name="slide")})
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(document))
    assert not {each["name"] for each in only(call, path)["findings"]} & {"wide-steps", "sign-flips"}


ASSETS = (
    "BoxAnimated.gltf",
    "CesiumMan.glb",
    "InterpolationTest.gltf",
    "RiggedSimple.gltf",
)
LARGE = (
    "AnimationPointer/24_animation_pointer.gltf",
    "BitmojiRun.glb",
    "BusterDrone/busterDrone.gltf",
    "Knight.glb",
    "MorphStressTest.glb",
    "Robot.glb",
)  # up to half a minute each


@pytest.mark.parametrize("name", [*ASSETS, *(pytest.param(name, marks=pytest.mark.slow) for name in LARGE)])
def test_assets(name: str, call: Call, asset: Find, tmp_path: Path) -> None:
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(opened_path(asset(name))))
    assert follow(call, path) or name == "none"


def test_late_starts_are_one_finding(call: Call, asset: Find) -> None:
    found = [each for each in only(call, asset("MorphStressTest.glb"))["findings"] if each["name"] == "late-start"]
    assert [each["where"] for each in found] == ["clips 'Individuals', 'TheWave', 'Pulse'"]
    assert "first key at 0.0333 s" in found[0]["problem"]


def test_what_players_ignore_is_no_error(call: Call, asset: Find) -> None:
    path = asset("BitmojiRun.glb")
    severities = {each["name"]: each["severity"] for each in only(call, path)["findings"]}
    assert severities["skeleton-hint"] == "warning"
    assert call("inspect", path, "--fail-on", "error").code == 0


@pytest.mark.parametrize(
    ("line", "word", "option"),
    [
        (("ease", "--clip", "walk"), "stutter", ["--per", "range"]),
        (("spline", "--tangents", "bspline"), "does not pass through its keys", ["--tangents", "natural"]),
        (("bake", "--clip", "jump"), "between frames", ["--fps", "240"]),
    ],
)
def test_notes_name_the_option_that_ends_them(
    line: tuple[str, ...], word: str, option: list[str], call: Call, tmp_path: Path
) -> None:
    path, (command, *options) = tmp_path / "in.glb", line
    path.write_bytes(built("biped"))
    noted = call(command, path, "-", *options)
    assert word in noted.err
    assert option[0] in noted.err
    followed = call(command, path, "-", *options, *option)
    assert followed.code == 0
    assert word not in followed.err
