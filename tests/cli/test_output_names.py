"""Names of outputs with places in them: settled before any work, and none stands for nothing."""

from __future__ import annotations

import os
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.io.output_names import expand
from tests.cli.conftest import Call
from tests.cli.running import help_line, refusal
from tests.files import glb_of, opened_fixture
from tests.fixtures.reading import split


def test_names_are_told_apart() -> None:
    clips = [{"clip": "walk"}, {"clip": "Walk"}, {"clip": "a/b"}, {"clip": ""}]
    assert expand("x/{clip}.npz", clips, [0, 3, 4, 5]) == ["x/walk.npz", "x/Walk-3.npz", "x/a_b.npz", "x/5.npz"]
    assert expand("{mesh}-{clip}.npz", [{"mesh": "{clip}", "clip": "a"}], [0]) == ["{clip}-a.npz"]
    clips = [{"clip": "\u00e4"}, {"clip": "a\u0308"}, {"clip": "A\u0308"}]  # one name where accents are combined
    assert expand("{clip}.npz", clips, [0, 1, 2]) == ["\u00e4.npz", "a\u0308-1.npz", "A\u0308-2.npz"]


def test_names_of_many_clips_are_told_apart_at_once() -> None:
    """It takes half a minute to compare each name with all before it."""
    count = 50_000
    clips = [{"clip": f"c{i // 2}"} for i in range(count)]
    names = expand("{clip}.npz", clips, range(count))
    assert names[:3] == ["c0.npz", "c0-1.npz", "c1.npz"]
    assert len(set(names)) == count


@pytest.mark.parametrize(
    "line",
    [
        ["bake", "{clip}-{foo}.npz"],
        ["convert", "{foo}.glb"],
        ["resample", "--fps=4", "{clip}.glb"],
        ["render", "{clip}.png"],
        ["sample", "--at=0", "{foo}.csv"],
    ],
)
def test_a_place_for_nothing_is_refused(line: list[str], call: Call, walk: Path, tmp_path: Path) -> None:
    command, *options, out = line
    run = call(command, walk, tmp_path / out, *options)
    assert "stands for nothing" in refusal(run, 2)
    if "expected a name without" in run.err:
        assert help_line(run) == "bake writes a file per {clip} and {mesh}, convert to USD one per {clip}"
    assert list(tmp_path.iterdir()) == [walk]


def test_braces_that_are_no_place_are_a_name(call: Call, walk: Path, tmp_path: Path) -> None:
    call("convert", walk, tmp_path / "{1234-ab}.glb").product()
    assert (tmp_path / "{1234-ab}.glb").is_file()


def test_names_in_the_file_may_have_braces(call: Call, tmp_path: Path) -> None:
    """Only the pattern is asked for placeholders; a name that looks like one is a name."""
    document = opened_fixture("biped")
    names = {"meshes": ["fox {LOD0}"], "animations": ["{mesh}", "{foo}", "a{b}/c"]}
    named = {
        key: [{**each, "name": name} for each, name in zip(document.json[key], new, strict=True)]
        for key, new in names.items()
    }
    path = tmp_path / "in.glb"
    path.write_bytes(glb_of(replace(document, json={**document.json, **named})))
    call("bake", path, tmp_path / "{mesh} {clip}.npz", "--fps", "4").product()
    assert sorted(each.stem for each in tmp_path.glob("*.npz")) == [
        "fox {LOD0} a{b}_c",
        "fox {LOD0} {foo}",
        "fox {LOD0} {mesh}",
    ]


def test_a_file_per_mesh(call: Call, walk: Path, tmp_path: Path) -> None:
    """Split by mesh or not, all vertices are there, in the order of the scene."""
    options = ("--fps", "4", "--clip", "walk", "--rigid")
    call("bake", walk, tmp_path / "all.npz", *options).product()
    call("bake", walk, tmp_path / "{mesh}-{clip}.npz", *options).product()
    names = {each["name"] for each in split(walk.read_bytes())[0]["meshes"]}
    files = sorted(tmp_path.glob("*-walk.npz"))
    assert {path.name.removesuffix("-walk.npz") for path in files} <= names
    whole = np.load(tmp_path / "all.npz")["positions"]
    parts = [np.load(path)["positions"] for path in files]
    assert sum(part.shape[1] for part in parts) == whole.shape[1]
    for part in parts:
        at = [i for i in range(whole.shape[1]) if np.array_equal(whole[:, i : i + part.shape[1]], part)]
        assert at


def test_all_names_are_settled_before_the_first_file_is_written(call: Call, walk: Path, tmp_path: Path) -> None:
    (tmp_path / "wave.npz").mkdir()
    assert "is a folder" in refusal(call("bake", walk, tmp_path / "{clip}.npz", "--fps", "4"), 2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["walk.glb", "wave.npz"]


def test_what_was_written_before_a_failure_is_said(
    call: Call, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from anim.errors import OutputError
    from cli.io import cache_files

    real = cache_files.save

    def save(*args: object, **options: object) -> object:
        if list(tmp_path.glob("*.npz")):
            raise OutputError("no space left")
        return real(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(cache_files, "save", save)
    run = call("bake", walk, tmp_path / "{clip}.npz", "--fps", "4")
    written = list(tmp_path.glob("*.npz"))
    assert run.code == 3
    assert f"note: 1 file written before: {written[0]}\n" in run.err


@pytest.mark.parametrize("name", ["-x.glb", "-out.gltf"])
def test_a_name_that_begins_as_an_option_gets_help(name: str, call: Call) -> None:
    run = call("inspect", name)
    assert "no such option" in refusal(run, 2)
    assert help_line(run) == f"if it is a file, write ./{name}"


@pytest.mark.parametrize(
    ("line", "near"),
    [
        (["convert", "IN", "x.gtlf"], "x.gltf"),
        (["loop", "IN", "x.GLBB", "--clip", "walk"], "x.glb"),
        (["optimize", "IN", "x.gl"], "x.glb"),
        (["resample", "IN", "x.foo", "--fps", "4"], None),
        (["trim", "IN", "x.glb.bak", "--to", "1"], None),
        (["from-euler", "none.bvh", "x.bin"], None),
    ],
)
def test_an_ending_that_is_no_gltf_is_refused(
    line: list[str], near: str | None, call: Call, walk: Path, tmp_path: Path
) -> None:
    name = line[2]
    run = call(line[0], walk if line[1] == "IN" else line[1], tmp_path / name, *line[3:])
    said = refusal(run, 2)
    assert f"glTF is no {Path(name).suffix.lower()} (expected .glb, .gltf, .vrm or .vrma, or a name" in said
    assert help_line(run) == ("" if near is None else f"did you mean {tmp_path / near}?")
    assert list(tmp_path.iterdir()) == [walk]


@pytest.mark.parametrize("name", ["x", "x.GLB", "x.vrm", "x.vrma", ".hidden"])
def test_endings_of_a_glb(name: str, call: Call, walk: Path, tmp_path: Path) -> None:
    call("convert", walk, tmp_path / name).product()
    assert (tmp_path / name).read_bytes()[:4] == b"glTF"


def test_what_is_no_plain_file_may_be_called_anything(call: Call, walk: Path, tmp_path: Path) -> None:
    call("convert", walk, os.devnull).product()
    pipe = tmp_path / "pipe.out"
    os.mkfifo(pipe)
    found: list[bytes] = []
    reader = threading.Thread(target=lambda: found.append(pipe.read_bytes()))
    reader.start()
    call("convert", walk, pipe).product()
    reader.join()
    assert found[0][:4] == b"glTF"
