"""Which format is written and read where the name doesn't say it: --format, pipes, other endings; and what is noted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.caches.registry import CACHE_FORMATS, READABLE, Files, sniff_format
from anim.caches.transforms.resample import at_time
from tests.anim.caches.making import cache, written
from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal

WHOLE, FRAMES, TEXTURES = (
    tuple(ending for ending, each in CACHE_FORMATS.items() if each.files is files)
    for files in (Files.ONE, Files.FRAMES, Files.SEVERAL)
)


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """A cache of seven frames in a file, in a folder of its own."""
    (tmp_path / "walk.npz").write_bytes(written(cache(normals=False), "walk.npz")[0].files["walk.npz"])
    return tmp_path / "walk.npz"


def told(data: bytes) -> str:
    return sniff_format(data[:1024], len(data))


def times(path: Path) -> list[float]:
    with np.load(path) as arrays:
        found: list[float] = arrays["times"].tolist()
        return found


@pytest.mark.parametrize("ending", WHOLE)
def test_a_pipe_takes_what_is_asked_for(ending: str, walk: Path, call: Call, fixture: Fixture) -> None:
    for run in (
        call("convert-cache", walk, "-", "--format", ending[1:]),
        call("bake", fixture("arm"), "-", "--clip", "twist", "--fps", "5", "--format", ending[1:]),
    ):
        assert told(run.product()) == ending
        assert " files" not in run.err


@pytest.mark.parametrize("ending", FRAMES)
def test_a_pipe_takes_one_frame_and_gives_it_back(ending: str, walk: Path, call: Call) -> None:
    run = call("convert-cache", walk, "-", "--format", ending[1:])
    assert f"stdout: {ending[1:]} is a file a frame, of 7 (expected a file name)" in refusal(run, 2)
    assert "--at" in help_line(run)
    data = call("convert-cache", walk, "-", "--format", ending[1:], "--at", "0.1").product()
    assert told(data) == ending
    call("convert-cache", "-", walk.with_name("back.npz"), stdin=data).product()
    with np.load(walk) as source, np.load(walk.with_name("back.npz")) as back:
        corners = source["positions"][3][source["faces"]]
        assert back["positions"][0][back["faces"]] == pytest.approx(corners, abs=1e-6)


@pytest.mark.parametrize("ending", TEXTURES)
def test_textures_go_through_no_pipe(ending: str, walk: Path, call: Call, fixture: Fixture) -> None:
    words = f"{ending[1:]} is several files (expected a file name)"
    assert words in refusal(call("convert-cache", walk, "-", "--format", ending[1:]), 2)
    assert words in refusal(call("bake", fixture("arm"), "-", "--clip", "twist", "--format", ending[1:]), 2)
    data = written(cache(), f"a{ending}")[0].files[f"a{ending}"]
    run = call("convert-cache", "-", walk.with_name("back.npz"), stdin=data)
    assert f"stdin: {words}" in refusal(run, 2)


@pytest.mark.parametrize("data", [b"hello there\n", b"", b"\x89PNH" * 30])
def test_a_pipe_of_something_else_is_exit_3(data: bytes, walk: Path, call: Call) -> None:
    assert "stdin: " in refusal(call("convert-cache", "-", walk.with_name("back.npz"), stdin=data), 3)


@pytest.mark.parametrize("name", ["walk.dat", "walk"])
@pytest.mark.parametrize("ending", CACHE_FORMATS)
def test_format_is_written_whatever_the_name_and_read_back(ending: str, name: str, walk: Path, call: Call) -> None:
    out = walk.parent / "out" / name
    out.parent.mkdir()
    call("convert-cache", walk, out, "--format", ending[1:]).product()
    main = next(path for path in (out, out.with_stem(f"{out.stem}_00001")) if path.exists())
    assert told(main.read_bytes()) == ending
    if ending not in READABLE:
        assert "is only written, not read" in refusal(call("convert-cache", out, walk.with_name("back.npz")), 4)
        return
    call("convert-cache", out, walk.with_name("back.npz")).product()
    assert times(walk.with_name("back.npz")) == pytest.approx(times(walk), abs=1e-6)


@pytest.mark.parametrize("first", CACHE_FORMATS)
@pytest.mark.parametrize("second", CACHE_FORMATS)
def test_a_name_that_says_another_format_is_refused(first: str, second: str, walk: Path, call: Call) -> None:
    there = sorted(walk.parent.iterdir())
    if first == second:
        run = call("convert-cache", walk, walk.with_name(f"a{first.upper()}"), "--format", second[1:], "--at", "0")
        assert run.code == 0, run.err
        assert told(walk.with_name(f"a{first.upper()}").read_bytes()) == first
        return
    run = call("convert-cache", walk, walk.with_name(f"a{first}"), "--format", second[1:])
    assert f"a{first}: the name says {first[1:]}, --format says {second[1:]}" in refusal(run, 2)
    assert sorted(walk.parent.iterdir()) == there


def test_a_name_of_no_format_is_read_by_its_bytes(walk: Path, call: Call) -> None:
    other, text = walk.with_name("walk.bin"), walk.with_name("read.md")
    other.write_bytes(walk.read_bytes())
    text.write_text("hello\n")
    call("convert-cache", other, walk.with_name("back.npz")).product()
    assert walk.with_name("back.npz").read_bytes() == walk.read_bytes()
    assert "unsupported cache format '.md'" in refusal(call("convert-cache", text, walk.with_name("b.npz")), 4)


def test_what_goes_through_a_pipe_is_counted(walk: Path, call: Call) -> None:
    run = call("convert-cache", walk, "-", "--format", "pc2")
    assert len(run.out) == 32 + 7 * 9 * 12 == 788
    assert "note: not written, since the output is a pipe: stdout-rest.ply" in run.err
    assert "→ 788 B" in run.err


def test_frames_of_a_longer_sequence_are_said_and_kept(walk: Path, call: Call) -> None:
    out = walk.with_name("s.obj")
    assert "of before" not in call("convert-cache", walk, out).err
    assert "of before" not in call("convert-cache", walk, out).err
    run = call("convert-cache", walk, out, "--fps", "10")
    words = "4 frames of before still there, from s_00004.obj on: what reads the sequence reads them too"
    assert f"warning: {words}\n" in run.err
    assert len(list(walk.parent.glob("s_*.obj"))) == 7
    run = call("convert-cache", walk, out, "--at", "0")
    assert "warning: 7 frames of before still there, from s_00001.obj on: " in run.err
    run = call("convert-cache", walk, out, "-q")
    assert "warning: s.obj of before is still there, and is what that name reads\n" in run.err


def test_uneven_frames_are_said(tmp_path: Path, call: Call) -> None:
    with (tmp_path / "a.npz").open("wb") as file:
        np.savez(file, positions=np.eye(3, dtype="f4")[None].repeat(4, 0), times=[0, 0.1, 0.5, 0.6], faces=[[0, 1, 2]])
    words = "note: frames are not evenly spaced: 0.1 … 0.4 s apart (a frame rate spaces them)\n"
    for name in ("b.ply", "b.obj", "b.stl", "b.exr", "b.png"):
        assert words in call("convert-cache", tmp_path / "a.npz", tmp_path / name).err
    assert "evenly" not in call("convert-cache", tmp_path / "a.npz", tmp_path / "c.ply", "--fps", "10").err
    assert "evenly" not in call("convert-cache", tmp_path / "a.npz", tmp_path / "c.mdd").err


def test_a_rest_mesh_of_another_cache_is_said(walk: Path, call: Call) -> None:
    out, back = walk.with_name("a.pc2"), walk.with_name("back.npz")
    call("convert-cache", walk, out).product()
    assert "note" not in call("convert-cache", out, back).err
    call("convert-cache", walk, out, "--up", "z", "--rest-mesh", "none").product()
    said = call("convert-cache", out, back).err
    assert "warning: 'a.pc2-rest.ply' is the rest mesh of another cache: left out\n" in said


def test_directions_that_are_lost_are_said(tmp_path: Path, call: Call) -> None:
    source, played = tmp_path / "a.npz", tmp_path / "a.glb"
    source.write_bytes(written(cache(tangents=True), "a.npz")[0].files["a.npz"])
    run = call("convert-cache", source, tmp_path / "a.pc2")
    assert "note: normals and tangents are left out: pc2 has no place for them\n" in run.err
    assert "note: tangents are left out: ply has no place" in call("convert-cache", source, tmp_path / "a.ply").err
    assert "left out" not in call("convert-cache", source, played).err
    run = call("convert-cache", played, tmp_path / "b.npz")
    assert "warning: normals and tangents are not played: bake the glTF file with them\n" in run.err


@pytest.mark.slow
def test_one_frame_of_any_format_reads_the_same_by_name_and_pipe(tmp_path: Path, call: Call) -> None:
    for ending in (each for each in (*WHOLE, *FRAMES) if each in READABLE):
        files = written(at_time(cache(normals=False), 0), f"a{ending}", None)[0].files
        (tmp_path / f"a{ending}").write_bytes(files[f"a{ending}"])
        call("convert-cache", tmp_path / f"a{ending}", tmp_path / "one.npz").product()
        call("convert-cache", "-", tmp_path / "two.npz", stdin=files[f"a{ending}"]).product()
        assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()


def test_a_flip_book_has_no_error_to_bound(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    args = ("--clip", "bend", "--layout", "flip-scale", "--max-error", "1mm")
    line = refusal(call("bake", fixture("arm"), tmp_path / "a.glb", *args), 2)
    assert "--max-error does not apply to a flip-book" in line
