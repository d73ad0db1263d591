"""`convert-cache`: from every format to every other, in files and pipes, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.caches.registry import READABLE
from tests.anim.caches.making import FACES, cache, written
from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal, shell
from tests.files import mark_slow

LOSSY = {".glb": 1e-4, ".gltf": 1e-4, ".png": 2e-4}
EVERY = [ending for ending in READABLE if ending != ".stl"]
PAIRS = [(first, second) for first in EVERY for second in EVERY]
RING = list(zip(EVERY, (*EVERY[1:], EVERY[0]), strict=True))  # each is read and written once
OPTIONS = {ending: ["--max-error", "0.1mm"] for ending in (".glb", ".gltf")}


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """A cache in a file, in a folder of its own."""
    (tmp_path / "walk.npz").write_bytes(written(cache(), "walk.npz")[0].files["walk.npz"])
    return tmp_path / "walk.npz"


def positions(path: Path) -> np.ndarray:
    with np.load(path) as arrays:
        found: np.ndarray = arrays["positions"]
        return found


@pytest.mark.parametrize(("first", "second"), mark_slow(PAIRS, slow=[pair for pair in PAIRS if pair not in RING]))
def test_every_format_becomes_every_other(first: str, second: str, walk: Path, call: Call) -> None:
    one, two, back = walk.with_name(f"one{first}"), walk.with_name(f"two{second}"), walk.with_name("back.npz")
    call("convert-cache", walk, one, *OPTIONS.get(first, [])).product()
    call("convert-cache", one, two, *OPTIONS.get(second, [])).product()
    call("convert-cache", two, back).product()
    off = np.abs(positions(back) - positions(walk)).max()
    assert off <= 1e-5 + LOSSY.get(first, 0) + LOSSY.get(second, 0)
    with np.load(back) as arrays:
        assert arrays["times"] == pytest.approx(np.arange(7) / 30, abs=1e-6)
        assert (arrays["faces"] == FACES).all()


def test_one_line_says_what_came_of_it(walk: Path, call: Call) -> None:
    run = call("convert-cache", walk, walk.with_name("a.mdd"))
    assert run.out == b""
    note, line = run.err.splitlines()
    assert note == "note: normals are left out: mdd has no place for them"
    assert line.endswith("s")
    for words in ("a.mdd  ", "kB", "7 frames of 9 vertices", "2 files"):
        assert words in line
    assert call("convert-cache", walk, walk.with_name("a.mdd"), "-q").err == ""


@pytest.mark.slow
def test_pipes(walk: Path, tmp_path: Path) -> None:
    run = shell(
        "gltf-anim convert-cache - - --format pc2 < walk.npz | gltf-anim convert-cache - - --format mdd --input-fps 30 "
        "| gltf-anim convert-cache - back.npz",
        tmp_path,
    )
    assert run.code == 0, run.err
    assert "not written, since the output is a pipe: stdout-rest.ply" in run.err
    assert (positions(tmp_path / "back.npz") == positions(walk)).all()
    same = shell("gltf-anim convert-cache -q < walk.npz | cmp - walk.npz", tmp_path)
    assert same.code == 0, same.err


def test_for_blender(walk: Path, call: Call) -> None:
    out = walk.with_name("a.pc2")
    call("convert-cache", walk, out, "--up", "z", "--vertex-order", "blender").product()
    data = out.read_bytes()
    assert np.frombuffer(data[16:20], "<i4") == 8
    x, y, z = np.moveaxis(positions(walk)[:, :8], -1, 0)
    assert (np.frombuffer(data[32:], "<f4").reshape(7, 8, 3) == np.stack((x, -z, y), axis=-1)).all()


@pytest.mark.parametrize("ending", [".glb", ".gltf"])
def test_gltf_has_y_up_whatever_the_input_has(ending: str, walk: Path, call: Call) -> None:
    lying, out, back = (walk.with_name(name) for name in ("z.npz", f"a{ending}", "back.npz"))
    call("convert-cache", walk, lying, "--up", "z").product()
    call("convert-cache", lying, out, "--max-error", "0.1mm").product()
    call("convert-cache", out, back).product()
    assert positions(back) == pytest.approx(positions(walk), abs=1.1e-4)
    call("convert-cache", lying, out, "--max-error", "0.1mm", "--up", "z").product()
    call("convert-cache", out, back).product()
    assert positions(back) == pytest.approx(positions(lying), abs=1.1e-4)


def test_alembic_has_y_up_whatever_the_input_has(walk: Path, call: Call) -> None:
    pytest.importorskip("alembic3d", reason="alembic3d is not installed")
    lying, out, same = (walk.with_name(name) for name in ("z.npz", "a.abc", "b.abc"))
    call("convert-cache", walk, lying, "--up", "z").product()
    call("convert-cache", lying, out).product()
    call("convert-cache", walk, same).product()
    assert out.read_bytes() == same.read_bytes()


def test_other_formats_have_the_up_axis_of_the_input(walk: Path, call: Call) -> None:
    lying, out, back = (walk.with_name(name) for name in ("z.npz", "a.mdd", "back.npz"))
    call("convert-cache", walk, lying, "--up", "z").product()
    call("convert-cache", lying, out).product()
    call("convert-cache", out, back).product()
    assert (positions(back) == positions(lying)).all()


def test_other_frames(walk: Path, call: Call) -> None:
    call("convert-cache", walk, walk.with_name("a.npz"), "--fps", "60").product()
    found, source = positions(walk.with_name("a.npz")), positions(walk)
    assert (found[::2] == source).all()
    assert found[1::2] == pytest.approx((source[1:] + source[:-1]) / 2, abs=1e-6)
    call("convert-cache", walk, walk.with_name("b.ply"), "--at", "0.1").product()
    assert walk.with_name("b.ply").is_file()


def test_an_input_can_be_its_own_output_and_is_touched_so_that_make_settles(walk: Path, call: Call) -> None:
    before, stamp = walk.read_bytes(), walk.stat().st_mtime_ns
    call("convert-cache", walk, walk).product()
    assert walk.read_bytes() == before
    assert walk.stat().st_mtime_ns > stamp
    call("convert-cache", walk, walk, "--up", "z").product()
    assert walk.read_bytes() != before
    assert [path.name for path in walk.parent.iterdir()] == ["walk.npz"]


def test_a_dry_run_writes_nothing(walk: Path, call: Call) -> None:
    run = call("convert-cache", walk, walk.with_name("a.pc2"), "--dry-run")
    assert "nothing written" in run.err
    assert [path.name for path in walk.parent.iterdir()] == ["walk.npz"]


@pytest.mark.parametrize("ending", EVERY)
def test_cut_off_files_are_exit_3_in_one_line_and_leave_nothing(ending: str, walk: Path, call: Call) -> None:
    files, _ = written(cache(), f"a{ending}")
    for name, data in files.files.items():
        is_main = name == f"a{ending}" or ending in (".ply", ".obj")
        walk.with_name(name).write_bytes(data[: len(data) // 3] if is_main else data)
    there = sorted(walk.parent.iterdir())
    line = refusal(call("convert-cache", walk.with_name(f"a{ending}"), walk.with_name("out.npz")), 3)
    assert f"a{ending}: " in line
    assert sorted(walk.parent.iterdir()) == there


def test_links_are_written_through(walk: Path, tmp_path: Path, call: Call) -> None:
    (tmp_path / "away").mkdir()
    link, real = tmp_path / "a.pc2", tmp_path / "away" / "real.pc2"
    real.write_bytes(b"old")
    link.symlink_to(real)
    call("convert-cache", walk, link).product()
    assert link.is_symlink()
    assert real.read_bytes().startswith(b"POINTCACHE2")
    assert sorted(real.parent.iterdir()) == [real, real.with_name("real.pc2-rest.ply")]


def test_a_device_takes_the_place_of_no_file(walk: Path, tmp_path: Path, call: Call) -> None:
    before = sorted(tmp_path.iterdir())
    call("convert-cache", walk, "/dev/null", "--format", "npz").product()
    assert Path("/dev/null").is_char_device()
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", ["no.pc2", "no.usdc", "no.ply", "no.npz", "no.exr", "no/a.0001.ply"])
def test_missing_files(name: str, tmp_path: Path, call: Call) -> None:
    assert f"{name}: " in refusal(call("convert-cache", tmp_path / name, tmp_path / "a.npz"), 3)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["a.fbx"], "unsupported cache format '.fbx'"),
        (["a.npz", "--max-error", "1mm"], "--max-error does not apply to .npz"),
        (["a.mdd", "--preset", "unity"], "--preset does not apply to .mdd"),
        (["a.glb", "--max-error", "1parsec"], "expected a length"),
        (["a.png", "--preset", "godot"], "cuts 16-bit PNG"),
        (["a.mdd", "--input-fps", "9"], "--input-fps does not apply to .npz"),
        (["a.npz", "--at", "9"], "no frame at 9 s"),
        (["a.npz", "--at", "0", "--fps", "9"], "exclude each other"),
        (["a.npz", "--fps", "0"], "--fps is 0 (expected a number above 0)"),
        (["a.npz", "--input-fps", "-1"], "--input-fps is -1 (expected 1e-06 to 1e+06)"),
        (["a.npz", "--input-fps", "1e18"], "--input-fps is 1e+18 (expected 1e-06 to 1e+06)"),
    ],
)
def test_what_can_t_be_done_is_exit_2(args: list[str], words: str, walk: Path, call: Call) -> None:
    there = sorted(walk.parent.iterdir())
    run = call("convert-cache", walk, walk.parent / args[0], *args[1:])
    assert words in refusal(run, 2)
    assert sorted(walk.parent.iterdir()) == there


def test_a_gltf_is_played(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    run = call("convert-cache", fixture("arm"), tmp_path / "arm.npz", "--input-fps", "10")
    assert run.err.startswith("warning: clip 'twist', one of 2; bake takes others by --clip\n")
    assert positions(tmp_path / "arm.npz").shape[0] == 11
    assert "warning: clip" not in call("convert-cache", tmp_path / "arm.npz", tmp_path / "arm.glb").err
    assert "warning: clip" not in call("convert-cache", tmp_path / "arm.glb", tmp_path / "arm.mdd").err


def test_uneven_frames_get_an_advice(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    with (tmp_path / "a.npz").open("wb") as file:
        np.savez(file, positions=np.zeros((4, 3, 3), "f4"), times=[0, 0.1, 0.5, 0.6], faces=[[0, 1, 2]])
    run = call("convert-cache", tmp_path / "a.npz", tmp_path / "a.pc2")
    assert "even steps" in refusal(run, 2)
    assert "--fps" in help_line(run)
    call("convert-cache", tmp_path / "a.npz", tmp_path / "a.pc2", "--fps", "10").product()


def test_bvh_is_sent_to_its_own_commands(call: Call, tmp_path: Path, walk: Path) -> None:
    (tmp_path / "walk.bvh").write_text("HIERARCHY")
    run = call("convert-cache", tmp_path / "walk.bvh", tmp_path / "out.npz")
    assert "unsupported cache format '.bvh'" in refusal(run, 4)
    assert help_line(run) == "gltf-anim from-euler makes glTF of BVH"
    assert help_line(call("convert-cache", walk, tmp_path / "out.bvh")) == "gltf-anim to-euler writes BVH"
