"""Errors: the exit code, one line with the right words, maybe a line of help."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import pytest

import fixtures
from anim.errors import (
    AnimError,
    FormatError,
    NotFoundError,
    OutputError,
    RangeError,
    ShapeError,
    UnsupportedError,
    not_written,
)
from cli import errors
from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, help_line, refusal, shell
from tests.files import glb_of, opened_fixture

Failure = TypeVar("Failure", bound=Exception)

# Exit codes.


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (RangeError("x"), 2),
        (errors.UsageError("x"), 2),
        (FormatError("x"), 3),
        (OutputError("x"), 3),
        (UnsupportedError("x"), 4),
        (NotFoundError("x"), 5),
        (errors.CheckError("x"), 6),
        (KeyboardInterrupt(), 130),
        (MemoryError(), 4),
    ],
)
def test_every_refusal_has_its_exit_code(
    error: BaseException, code: int, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    def fails() -> None:
        raise error

    assert errors.run_guarded(fails) == code
    out, err = capsysbinary.readouterr()
    assert out == b""
    expected = {130: "", 4: "gltf-anim: out of memory\n"} if not isinstance(error, AnimError) else {}
    assert err.decode() == expected.get(code, "gltf-anim: x\n")


@pytest.mark.parametrize("error", [ValueError("odd"), ShapeError("odd"), OSError("odd")])
def test_a_bug_of_ours_is_1_with_a_traceback(error: Exception, capsys: pytest.CaptureFixture[str]) -> None:
    def fails() -> None:
        raise error

    assert errors.run_guarded(fails) == 1
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert "odd" in err


def test_done_is_0_and_a_number_is_passed_on() -> None:
    assert errors.run_guarded(lambda: None) == 0
    assert errors.run_guarded(lambda: True) == 0
    assert errors.run_guarded(lambda: 5) == 5


def test_where_and_help_are_shown_on_one_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    error = FormatError("broke\nat \x1b[1m", where="clip 'a\u2028b'", help="do\nthis")
    assert errors.report_error(error) == 3
    assert capsys.readouterr().err == "gltf-anim: clip 'a\\u2028b': broke\\nat \\x1b[1m\nhelp: do\\nthis\n"


# What was typed.


@pytest.mark.parametrize(
    ("line", "words", "hint"),
    [
        (["resampel"], "no such command 'resampel'", "did you mean 'resample'?"),
        (["zzz"], "no such command 'zzz'", "gltf-anim --help"),
        (["walk.glb"], "no such command 'walk.glb'", "gltf-anim --help"),
        (["--fps"], "no such option: --fps", "gltf-anim --help"),
        (["resample", "--fsp", "3"], "resample: no such option: --fsp", "did you mean '--fps'"),
        (["inspect", "--forma", "json"], "inspect: no such option: --forma", "did you mean '--format'?"),
        (["inspect", "--zzz"], "inspect: no such option: --zzz", "gltf-anim inspect --help"),
        (["loop", "-o", "x.glb"], "loop: no such option: -o", "IN OUT"),
        (["inspect", "-o", "x.glb"], "inspect: no such option: -o", "gltf-anim inspect --help"),
        (["resample"], "resample: missing option '--fps'", "gltf-anim resample --help"),
        (["resample", "--fps"], "resample: option '--fps' requires an argument", "gltf-anim resample --help"),
        (["resample", "--fps", "abc"], "invalid value for '--fps': 'abc' is no number", "gltf-anim resample --help"),
        (["resample", "--fps", "24fps"], "'24fps' is no number (expected 24, without a unit)", "resample --help"),
        (["trim", "--to", "0.5 s"], "'0.5 s' is no number (expected 0.5, without a unit)", "gltf-anim trim --help"),
        (["resample", "--fps", "inf"], "'inf' is no finite number", "gltf-anim resample --help"),
        (["convert", "--quiet=3"], "option '--quiet' does not take a value", "gltf-anim convert --help"),
        (["loop", "a", "b", "c"], "loop: got unexpected extra argument(s) (c)", "gltf-anim loop --help"),
        (["inspect", "--format", "jason"], "'jason' is none of text, json, csv", "did you mean 'json'?"),
        (["inspect", "--format", "xml"], "'xml' is none of text, json, csv", "gltf-anim inspect --help"),
        (
            ["resample", "--fps", "3", "--path", "rotate"],
            "'rotate' is none of translation,",
            "did you mean 'rotation'?",
        ),
    ],
)
def test_a_wrong_command_line_is_2_and_says_what_to_type(line: list[str], words: str, hint: str, call: Call) -> None:
    run = call(*line)
    assert words in refusal(run, 2)
    assert hint in help_line(run)


@pytest.mark.parametrize(
    ("options", "words", "hint"),
    [
        (["--clip", "wlak"], "no clip matches 'wlak'", "did you mean 'walk'?"),
        (["--clip", "WALK"], "no clip matches 'WALK'", "case differ: did you mean 'walk'?"),
        (["--clip", "zzz*"], "no clip matches 'zzz*'", "the clips are 'walk', 'wave', 'jump'"),
        (["--node", "left_fot"], "no node matches 'left_fot'", "did you mean 'left_foot'?"),
        (["--node", "zzz*"], "no node matches 'zzz*'", "the nodes are 'hips'"),
    ],
)
@pytest.mark.parametrize("command", [["sample"], ["resample", "--fps", "30"]])
def test_a_name_that_is_not_there_is_5(
    command: list[str], options: list[str], words: str, hint: str, call: Call, tmp_path: Path
) -> None:
    path = tmp_path / "hero.glb"
    path.write_bytes(built("biped"))
    name, *rest = command
    run = call(name, path, "-", *rest, *options)
    message = refusal(run, 5)
    assert message.startswith(f"gltf-anim: {path}: ")
    assert words in message
    assert hint in help_line(run)


def no_room(error: type[Failure]) -> Failure:
    """What numba raises where its library finds no room: the reason is in the error that it came from."""
    raised = error("could not find/load shared object file 'libllvmlite.so'")
    raised.__context__ = OSError("libllvmlite.so: failed to map segment from shared object")
    return raised


@pytest.mark.parametrize("error", [OSError, ImportError])
def test_no_room_for_a_library_is_out_of_memory(error: type[Exception], capsys: pytest.CaptureFixture[str]) -> None:
    def fail() -> None:
        raise no_room(error)

    assert errors.run_guarded(fail) == 4
    assert capsys.readouterr().err == "gltf-anim: out of memory\n"
    with pytest.raises(MemoryError):
        raise not_written("out.npz", no_room(OSError))
    assert str(not_written("out.npz", OSError(28, "No space left"))) == "out.npz: can't be written (no space left)"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere memory has no such limit")
def test_a_bake_without_memory_says_so(walk: Path, tmp_path: Path) -> None:
    run = shell("ulimit -v 300000; gltf-anim bake walk.glb out.npz --clip walk -q", tmp_path)
    assert refusal(run, 4) == "gltf-anim: out of memory"


@pytest.mark.parametrize(
    "line", [["resample", "--fps", "30"], ["ease", "--ease", "smoothstep"], ["retime", "--speed", "2"]]
)
@pytest.mark.parametrize("ending", [".glb", ".gltf"])
def test_a_file_without_clips_goes_through_as_it_is(line: list[str], ending: str, call: Call, tmp_path: Path) -> None:
    """With its spaces and line breaks."""
    document = opened_fixture("biped")
    content = {key: value for key, value in document.json.items() if key != "animations"}
    (tmp_path / "still.glb").write_bytes(glb_of(replace(document, json=content)))
    call("convert", tmp_path / "still.glb", tmp_path / "still.gltf").product()
    path, out = tmp_path / f"still{ending}", tmp_path / f"out{ending}"
    if ending == ".gltf":
        path.write_bytes(path.read_bytes().replace(b":", b" :   "))
    before = path.read_bytes()
    for place in (path, out):
        run = call(line[0], path, place, *line[1:])
        assert re.fullmatch(rf"{re.escape(str(place))}  [\d.]+ kB, unchanged: it has no clips\n", run.err)
        assert place.read_bytes() == before


def test_names_that_nothing_has(call: Call) -> None:
    bare = b'{"asset": {"version": "2.0"}}'
    run = call("inspect", "--clip", "walk", stdin=bare)
    assert "no clip matches 'walk'" in refusal(run, 5)
    assert help_line(run) == "the file has no clips"


# Files that are not there, or can't be written.


def test_inputs_that_cannot_be_read_are_3(call: Call, tmp_path: Path) -> None:
    for command in (["inspect"], ["convert"], ["sample"], ["resample", "--fps=3"]):
        name, *rest = command
        lost = tmp_path / "lost.glb"
        assert refusal(call(name, lost, *rest), 3) == f"gltf-anim: {lost}: can't be read (no such file or directory)"
        if name != "inspect":  # which looks for files in folders
            code = 3 if name == "sample" else 2  # they take folders, with --out
            assert f"{tmp_path}: is a folder" in refusal(call(name, tmp_path, *rest), code)
        assert refusal(call(name, "", *rest), 3) == "gltf-anim: '': is no file name"
        assert refusal(call(name, "-", *rest), 3) == "gltf-anim: stdin: is empty (expected glTF)"


def test_other_kinds_of_files_are_said_to_be_no_gltf(call: Call) -> None:
    assert "stdin: is no glTF: starts with b'\\x89PNG'" in refusal(call("inspect", stdin=b"\x89PNG\r\n"), 3)
    run = call("resample", "--fps", "30", stdin=b"HIERARCHY\r\nROOT hips\r\n")
    assert "stdin: is no glTF: starts with b'HIER'" in refusal(run, 3)
    assert help_line(run) == "gltf-anim from-euler makes glTF of BVH"
    assert "is no glTF" in refusal(call("inspect", stdin=b"HIERARCHY\nROOT"), 3)
    for head in (b"PK\x03\x04", b"POINTCACHE2\0", b"PXR-USDC", b"#usda 1.0"):
        run = call("inspect", stdin=head + bytes(30))
        assert "is no glTF" in refusal(run, 3)
        assert help_line(run).startswith("if it is a vertex cache: view and render show it, convert-cache makes .glb")


def test_a_pointer_of_git_lfs_says_how_to_get_the_file(call: Call) -> None:
    run = call("inspect", stdin=fixtures.BROKEN["lfs_pointer"].data)
    assert refusal(run, 3) == "gltf-anim: stdin: is a Git LFS pointer, not the file itself"
    assert help_line(run) == "git lfs pull"


def test_a_buffer_that_is_not_beside_its_gltf_says_where_to_put_it(
    call: Call, fixture: Fixture, tmp_path: Path
) -> None:
    path = fixture("gltf_external")
    (tmp_path / "walk data.bin").unlink()
    run = call("convert", path, tmp_path / "out.glb")
    assert refusal(run, 3) == f"gltf-anim: {path}: buffer 0: 'walk data.bin' is not beside the file"
    assert help_line(run) == f"put it into '{tmp_path}'"
