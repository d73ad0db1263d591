"""`convert`: the other container and nothing else, there and back."""

from __future__ import annotations

import base64
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fixtures
from tests import khronos
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import built, help_line, refusal
from tests.cli.untouched import around
from tests.files import ASSETS, REAL, mark_slow, opened_path
from tests.fixtures.reading import split

Json = dict[str, Any]


def text(path: Path) -> Json:
    found: Json = json.loads(path.read_text(encoding="utf-8"))
    return found


def same_but_for_buffers(one: Json, other: Json) -> bool:
    """Whether two documents are equal, order of keys included, but for where buffers lie."""
    lengths = [[buffer["byteLength"] for buffer in json.get("buffers", ())] for json in (one, other)]
    kept = [json.dumps({**document, "buffers": None}) for document in (one, other)]
    return kept[0] == kept[1] and lengths[0] == lengths[1]


@pytest.mark.parametrize("name", [name for name in fixtures.FIXTURES if not name.startswith("gltf")])
def test_glb_there_and_back_is_the_same_document(name: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    path, middle, back = fixture(name), tmp_path / "middle.gltf", tmp_path / "back.glb"
    call("convert", path, middle).product()
    call("convert", middle, back).product()
    before, after = split(path.read_bytes()), split(back.read_bytes())
    assert same_but_for_buffers(before[0], after[0])
    assert "uri" not in after[0]["buffers"][0]
    assert before[1] == after[1] == (tmp_path / "middle.bin").read_bytes()
    assert text(middle)["buffers"][0]["uri"] == "middle.bin"


@pytest.mark.parametrize("name", ["gltf_external", "gltf_embedded"])
def test_text_there_and_back_is_the_same_document(name: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    path, middle, back = fixture(name), tmp_path / "middle.glb", tmp_path / "back.gltf"
    call("convert", path, middle).product()
    call("convert", middle, back).product()
    assert same_but_for_buffers(text(path), text(back))
    buffer = split(middle.read_bytes())[1]
    assert (tmp_path / "back.bin").read_bytes() == buffer
    assert buffer == fixtures.COMPANIONS["gltf_external"]()["walk data.bin"]


@pytest.mark.parametrize("name", mark_slow(REAL))
def test_real_files_there_and_back_are_the_same(name: str, call: Call, asset: Find, tmp_path: Path) -> None:
    source = asset(name)
    ways = [tmp_path / "one.glb", tmp_path / "two.gltf", tmp_path / "three.glb"]
    for before, after in zip([source, *ways], ways, strict=False):
        call("convert", before, after, "-q").product()
    old = opened_path(source)
    for new in map(opened_path, ways):
        assert json.dumps(around(new.json)) == json.dumps(around(old.json))
        for key in ("accessors", "bufferViews"):
            assert new.json.get(key) == old.json.get(key)
        for before_buffer, after_buffer in zip(old.buffers, new.buffers, strict=True):
            assert np.array_equal(before_buffer.data, after_buffer.data)
    assert ways[0].read_bytes() == ways[2].read_bytes()


@khronos.needs_validator
def test_what_is_written_is_valid(call: Call, tmp_path: Path) -> None:
    fixtures.build_all(tmp_path)
    for name in fixtures.FIXTURES:
        source = next(iter(fixtures.build_files(name)))
        call("convert", tmp_path / source, tmp_path / f"{name}.out.glb").product()
        call("convert", tmp_path / source, tmp_path / f"{name}.out.gltf").product()
    paths = sorted(tmp_path.glob("*.out.gl*"))
    beside = {path.name: path.read_bytes() for path in tmp_path.glob("*.bin")}
    assert len(paths) == 2 * len(fixtures.FIXTURES)
    for path, report in zip(
        paths, khronos.validate_many([p.read_bytes() for p in paths], resources=beside), strict=True
    ):
        assert khronos.errors(report) == [], path.name


def test_a_pipe_takes_and_gives_glb(call: Call, fixture: Fixture) -> None:
    data = call("convert", fixture("gltf_external")).product()
    assert data.startswith(b"glTF")
    assert call("convert", stdin=data).product() == data
    assert call("convert", "-", "-", stdin=data).product() == data
    assert call("convert", stdin=data).err.startswith("stdin  ")


def test_text_through_a_pipe_must_hold_its_buffers(call: Call, fixture: Fixture) -> None:
    assert call("convert", stdin=fixture("gltf_embedded").read_bytes()).product().startswith(b"glTF")
    run = call("convert", stdin=fixture("gltf_external").read_bytes())
    assert "'walk data.bin' lies beside the file, but the input is a pipe" in refusal(run, 3)
    assert "path" in help_line(run)


@pytest.mark.parametrize(
    ("out", "bin_name", "uri"), [("a.gltf", "a.bin", "a.bin"), ("Ä b%.GLTF", "Ä b%.bin", "%C3%84%20b%25.bin")]
)
def test_the_bin_is_named_after_the_file(out: str, bin_name: str, uri: str, call: Call, tmp_path: Path) -> None:
    call("convert", "-", tmp_path / out, stdin=built("arm")).product()
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([out, bin_name])
    assert text(tmp_path / out)["buffers"][0]["uri"] == uri
    assert call("convert", tmp_path / out).product() == call("convert", stdin=built("arm")).product()


@pytest.mark.skipif(sys.platform in ("darwin", "win32"), reason="names there are Unicode")
@pytest.mark.parametrize(
    ("name", "uri"), [(b"n\nl", "n%0Al.bin"), (b"t\t\x1b[1m", "t%09%1B%5B1m.bin"), (b"bad\xff", "bad%FF.bin")]
)
def test_what_has_a_strange_name_can_be_read_again(name: bytes, uri: str, call: Call, tmp_path: Path) -> None:
    paths = [os.fsdecode(os.fsencode(tmp_path) + b"/" + name + ending) for ending in (b".glb", b".gltf")]
    Path(paths[0]).write_bytes(built("biped"))
    call("convert", *paths, "-q").product()
    assert json.loads(Path(paths[1]).read_bytes())["buffers"][0]["uri"] == uri
    assert call("convert", paths[1], "-", "-q").product() == built("biped")
    call("resample", paths[1], paths[1], "--fps", "9", "-q").product()
    assert {os.fsencode(path.name)[: len(name)] for path in tmp_path.iterdir()} == {name}
    assert len(list(tmp_path.iterdir())) == 3  # with one buffer


def test_a_file_that_is_already_what_it_shall_be_keeps_its_buffer(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    path = fixture("gltf_external")
    call("convert", path, path).product()
    call("convert", path, tmp_path / "copy.gltf").product()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["copy.gltf", "gltf_external.gltf", "walk data.bin"]
    assert text(tmp_path / "copy.gltf")["buffers"][0]["uri"] == "walk%20data.bin"
    (tmp_path / "elsewhere").mkdir()
    call("convert", path, tmp_path / "elsewhere" / "copy.gltf").product()
    assert sorted(file.name for file in (tmp_path / "elsewhere").iterdir()) == ["copy.bin", "copy.gltf"]


def test_further_buffers_become_data_uris_and_stay_apart(call: Call, tmp_path: Path) -> None:
    buffers = [{"byteLength": 4, "uri": "one.bin"}, {"byteLength": 8, "uri": "two.bin", "extras": {"kept": 1}}]
    views = [{"buffer": 0, "byteLength": 4}, {"buffer": 1, "byteLength": 8}]
    document = {"asset": {"version": "2.0"}, "buffers": buffers, "bufferViews": views}
    (tmp_path / "two.gltf").write_text(json.dumps(document))
    (tmp_path / "one.bin").write_bytes(b"1111")
    (tmp_path / "two.bin").write_bytes(b"22222222")
    found, first = split(call("convert", tmp_path / "two.gltf").product())
    assert first == b"1111"
    assert found["buffers"][0] == {"byteLength": 4}
    assert found["buffers"][1]["extras"] == {"kept": 1}
    assert base64.b64decode(found["buffers"][1]["uri"].split(",")[1]) == b"22222222"


def test_a_new_bin_never_takes_the_place_of_one_that_is_used(call: Call, tmp_path: Path) -> None:
    document = json.loads(built("gltf_external"))
    document["buffers"][0]["uri"] = "first.bin"
    document["buffers"].append({"byteLength": 12, "uri": "scene.bin"})
    document["bufferViews"].append({"buffer": 1, "byteLength": 12})
    (tmp_path / "scene.gltf").write_text(json.dumps(document))
    (tmp_path / "first.bin").write_bytes(fixtures.COMPANIONS["gltf_external"]()["walk data.bin"])
    (tmp_path / "scene.bin").write_bytes(b"not animated")
    call("resample", tmp_path / "scene.gltf", tmp_path / "scene.gltf", "--fps", "4").product()
    kept = text(tmp_path / "scene.gltf")["buffers"][1]
    assert (tmp_path / kept["uri"]).read_bytes() == b"not animated"


def test_the_line_says_both_sizes_and_quiet_says_nothing(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    path, out = fixture("gltf_external"), tmp_path / "out.glb"
    before = sum(len(data) for data in fixtures.build_files("gltf_external").values())
    run = call("convert", path, out)
    assert run.err.startswith(f"{out}  {before / 1000:.3g} kB → {out.stat().st_size / 1000:.3g} kB (")
    assert run.err.count("\n") == 1
    assert call("convert", path, out, "--quiet") == (0, b"", "")


def test_a_dry_run_writes_nothing(call: Call, tmp_path: Path) -> None:
    for out in ("-", tmp_path / "out.glb", tmp_path / "out.gltf"):
        run = call("convert", "-", out, "-n", stdin=built("arm"))
        assert (run.code, run.out) == (0, b"")
        assert " → " in run.err
        assert run.err.endswith(" (dry run: nothing written)\n")
    assert list(tmp_path.iterdir()) == []


def test_chunks_of_others_and_extras_stay(call: Call) -> None:
    document = {"asset": {"version": "2.0"}, "z": 1, "a": {"é": [1.0, 1e-7, 12345678901234567890, None, True]}}
    content = json.dumps(document).encode()
    content += b" " * (-len(content) % 4)
    chunk = b"\x08\0\0\0ACMEnotebook"[:16]
    total = 12 + 8 + len(content) + len(chunk)
    data = (
        b"glTF\2\0\0\0" + total.to_bytes(4, "little") + len(content).to_bytes(4, "little") + b"JSON" + content + chunk
    )
    out = call("convert", stdin=data).product()
    assert out.endswith(chunk)
    length = int.from_bytes(out[12:16], "little")
    assert json.dumps(json.loads(out[20 : 20 + length])) == json.dumps(document)


def test_a_number_beyond_float64_is_refused(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "in.gltf"
    path.write_bytes(
        fixtures.build_files("gltf_embedded")["gltf_embedded.gltf"].replace(b"{", b'{"extras":[-1E+999],', 1)
    )
    run = call("convert", path, tmp_path / "out.glb")
    assert "JSON holds a number too large for float64 (got -1E+999, expected at most 1.8e308)" in refusal(run, 3)


def test_what_it_cannot_hold_is_refused(call: Call, bad_input: Find, tmp_path: Path) -> None:
    run = call("convert", bad_input("buffer/custom_property.gltf"), tmp_path / "out.glb")
    assert "buffer 0: has no data" in refusal(run, 4)
    call("convert", bad_input("buffer/custom_property.gltf"), tmp_path / "out.gltf").product()


@pytest.mark.skipif(not ASSETS.is_dir(), reason="shared/assets is not there")
def test_the_list_of_real_files_is_complete() -> None:
    files = [path for path in ASSETS.rglob("*") if path.suffix in (".glb", ".gltf", ".vrm", ".vrma")]
    with_clips = {path for path in files if opened_path(path).json.get("animations")}
    assert {path.relative_to(ASSETS).as_posix() for path in with_clips} == set(REAL)
