"""Files are replaced whole, or not at all, and only where their bytes differ."""

from __future__ import annotations

import errno
import os
import re
import signal
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

import anim
from tests.cli.conftest import Call, Find
from tests.cli.running import ENVIRONMENT, ROOT, TIMEOUT, built, refusal, shell
from tests.files import mark_slow

# The command line, but it stops before it puts its finished temporary file into place.
PAUSED = """
import os, signal, sys, time
from cli import main
def paused(source, target):
    print("paused", file=sys.stderr, flush=True)
    time.sleep(600)
os.replace = paused
signal.signal(signal.SIGINT, signal.default_int_handler)
main.main()
"""


@pytest.mark.parametrize("before", [None, b"precious"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_a_killed_run_leaves_what_was_there(
    number: signal.Signals, code: int, before: bytes | None, walk: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.glb"
    if before is not None:
        out.write_bytes(before)
    command = [sys.executable, "-c", PAUSED, "convert", str(walk), str(out)]
    run = subprocess.Popen(command, cwd=ROOT, env=ENVIRONMENT, stderr=subprocess.PIPE)
    assert run.stderr is not None
    assert run.stderr.readline() == b"paused\n"
    run.send_signal(number)
    _, err = run.communicate(timeout=TIMEOUT)
    assert run.returncode in (code, -number)  # either way a shell says 128 + the signal's number
    assert b"Traceback" not in err
    assert (out.read_bytes() if out.exists() else None) == before
    others = {path.name for path in tmp_path.iterdir()} - {"walk.glb", "out.glb"}
    if number != signal.SIGKILL:
        assert others == set()
    else:  # nobody can clear up after that, but what is left is hidden and tells whose it was
        assert [name.startswith(".out.glb.") and name.endswith(".tmp") for name in others] == [True]


# The command line, but it says when Python has started.
READY = """
import sys
from cli import entry_point
print("ready", file=sys.stderr, flush=True)
entry_point.main()
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
@pytest.mark.parametrize("delay", mark_slow([0.1, 0.3, 0.6], slow=[0.1, 0.6]))
def test_a_run_killed_at_work_leaves_nothing(number: signal.Signals, delay: float, asset: Find, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-c",
        READY,
        "resample",
        str(asset("Knight.glb")),
        str(tmp_path / "out.glb"),
        "--fps",
        "240",
    ]
    run = subprocess.Popen(command, cwd=ROOT, env=ENVIRONMENT, stderr=subprocess.PIPE)
    assert run.stderr is not None
    assert run.stderr.readline() == b"ready\n"
    time.sleep(delay)
    run.send_signal(number)
    _, err = run.communicate(timeout=TIMEOUT)
    assert run.returncode in (128 + number, -number)
    assert list(tmp_path.iterdir()) == []
    assert err == b""


@pytest.mark.parametrize("fails", ["mkstemp", "write"])
def test_a_text_file_and_its_buffer_change_together(
    fails: str, call: Call, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    call("convert", walk, tmp_path / "out.gltf").product()
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    made: list[str] = []

    def mkstemp(*, prefix: str, suffix: str, dir: Path) -> tuple[int, str]:
        made.append(prefix)
        if len(made) == 2 and fails == "mkstemp":
            raise OSError(errno.ENOSPC, "No space left on device")
        handle, name = real(prefix=prefix, suffix=suffix, dir=dir)
        return (os.open(name, os.O_RDONLY) if len(made) == 2 else handle), name

    real = tempfile.mkstemp
    monkeypatch.setattr(tempfile, "mkstemp", mkstemp)
    run = call("resample", walk, tmp_path / "out.gltf", "--fps", "9")
    assert "out.gltf: can't be written (" in refusal(run, 3)
    assert [re.sub("-[0-9a-f]{8}", "-#", prefix) for prefix in made] == [".out-#.bin.", ".out.gltf."]
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_ctrl_c_is_130_for_the_shell(walk: Path, tmp_path: Path) -> None:
    script = tmp_path / "paused.py"
    script.write_text(PAUSED)
    line = f"PYTHONPATH='{ROOT}' '{sys.executable}' paused.py convert walk.glb out.glb 2> words & "
    line += "until grep -q paused words; do sleep 0.05; done; kill -INT $!; wait $!; echo $?"
    run = shell(line, tmp_path)
    assert run.text == "130\n"
    assert (tmp_path / "words").read_text() == "paused\n"


LINES = {
    "out.glb": ["resample", "--fps=9"],
    "out.gltf": ["resample", "--fps=9"],
    "out.csv": ["sample", "--at=0"],
    "out.pc2": ["bake", "--clip=#0", "--fps=4"],
    "out.png": ["render", "--clip=#0", "--frames=1"],
}


@pytest.mark.parametrize("out", LINES)
def test_equal_bytes_are_not_written_again_but_the_named_file_is_new(
    out: str, call: Call, walk: Path, tmp_path: Path
) -> None:
    """Or make would run the command again for ever."""
    line = [LINES[out][0], walk, tmp_path / out, *LINES[out][1:]]
    call(*line).product()
    for path in tmp_path.iterdir():
        os.utime(path, (1, 1))
    before = {path.name: path.stat() for path in tmp_path.iterdir()}
    call(*line, "--dry-run").product() if out in ("out.glb", "out.gltf", "out.pc2") else None
    assert {path.stat().st_mtime for path in tmp_path.iterdir()} == {1}
    call(*line).product()
    after = {path.name: path.stat() for path in tmp_path.iterdir()}
    assert {name: found.st_ino for name, found in after.items()} == {name: s.st_ino for name, s in before.items()}
    assert [name for name, found in after.items() if found.st_mtime != 1] == [out]
    walk.write_bytes(built("arm"))
    call(*line).product()
    assert (tmp_path / out).stat().st_ino != before[out].st_ino


def test_make_settles_where_bytes_are_equal(walk: Path, tmp_path: Path) -> None:
    (tmp_path / "Makefile").write_text("out.glb: walk.glb\n\t@echo made; gltf-anim convert walk.glb out.glb -q\n")
    line = "make; sleep 0.05; touch walk.glb; sleep 0.05; make; make"  # file times advance in ticks of up to 10 ms
    assert shell(line, tmp_path).text.count("made") == 2


@pytest.mark.parametrize("mode", [0o640, 0o600, 0o755, 0o664])
def test_mode_bits_are_kept(mode: int, call: Call, walk: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    out.touch()
    out.chmod(mode)
    call("convert", walk, out).product()
    assert out.read_bytes().startswith(b"glTF")
    assert stat.S_IMODE(out.stat().st_mode) == mode


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files to others")
@pytest.mark.parametrize("out", ["out.glb", "out.gltf"])
def test_files_of_others_stay_theirs(out: str, call: Call, walk: Path, tmp_path: Path) -> None:
    path = tmp_path / out
    path.touch()
    os.chown(path, 1234, 5678)
    call("convert", walk, path).product()
    assert path.stat().st_size > 0
    assert (path.stat().st_uid, path.stat().st_gid) == (1234, 5678)


@pytest.mark.parametrize(("mask", "mode"), [("022", 0o644), ("077", 0o600), ("002", 0o664)])
def test_new_files_have_the_mode_that_any_program_gives(mask: str, mode: int, walk: Path, tmp_path: Path) -> None:
    shell(f"umask {mask} && gltf-anim convert walk.glb out.glb", tmp_path).product()
    assert stat.S_IMODE((tmp_path / "out.glb").stat().st_mode) == mode


def test_links_are_written_through(call: Call, walk: Path, tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    real, link, dangling = tmp_path / "real" / "out.glb", tmp_path / "link.glb", tmp_path / "dangling.glb"
    real.write_bytes(b"old")
    link.symlink_to(real)
    dangling.symlink_to("real/new.glb")
    for path in (link, dangling):
        call("convert", walk, path).product()
        assert path.is_symlink()
    assert real.read_bytes() == (tmp_path / "real" / "new.glb").read_bytes() == call("convert", walk).product()
    assert sorted(path.name for path in (tmp_path / "real").iterdir()) == ["new.glb", "out.glb"]


def test_a_baked_gltf_takes_a_free_name_for_its_buffer(call: Call, tmp_path: Path) -> None:
    """That of a .gltf may be the buffer of another one, also of the input."""
    call("bake", walk_of(tmp_path), tmp_path / "k.gltf", "--clip", "bend", "--fps", "5").product()
    (tmp_path / "k.gltf").rename(tmp_path / "m.gltf")
    call("bake", tmp_path / "arm.glb", tmp_path / "c.npz", "--clip", "bend", "--fps", "4").product()
    before = contents(tmp_path)
    line = ("bake", tmp_path / "m.gltf", tmp_path / "k.gltf", "--rigid", "--fps", "4")
    call(*line).product()
    assert before.items() <= contents(tmp_path).items()
    made = contents(tmp_path)
    assert len(made) == len(before) + 2
    call(*line).product()
    assert contents(tmp_path) == made
    assert "max 0" in call("diff", tmp_path / "k.gltf", tmp_path / "k.gltf").text
    call("convert-cache", tmp_path / "c.npz", tmp_path / "k.gltf", "--onto", tmp_path / "arm.glb").product()
    assert before.items() <= contents(tmp_path).items()
    assert len(contents(tmp_path)) == len(made)  # an old buffer is removed
    call("bake", tmp_path / "m.gltf", tmp_path / "m.gltf", "--rigid", "--fps", "3").product()  # in place


def test_the_library_names_the_buffer_of_a_cache_so_too(tmp_path: Path) -> None:
    asset = anim.load(walk_of(tmp_path))
    for fps in (5, 4, 4):
        anim.bake(asset, "bend", fps=fps).save(tmp_path / "k.gltf")
        (buffer,) = tmp_path.glob("*.bin")
    assert buffer.name.startswith("k-")
    (tmp_path / "k.gltf").unlink()
    anim.bake(asset, "bend", fps=3).save(tmp_path / "k.gltf")
    assert {each.name for each in tmp_path.glob("*.bin")} == {"k.bin", buffer.name}


def walk_of(folder: Path) -> Path:
    (folder / "arm.glb").write_bytes(built("arm"))
    return folder / "arm.glb"


def contents(folder: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in folder.iterdir()}


def test_an_input_is_not_replaced_by_a_file_beside_the_output(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    source, given = tmp_path / "w.pc2-rest.ply", built("arm")
    source.write_bytes(given)
    for input, output in (("w.pc2-rest.ply", tmp_path / "w.pc2"), (source, "w.pc2")):
        run = call("bake", input, output, "--clip", "bend", "--fps", "5")
        assert "would be replaced by the file of this name beside" in refusal(run, 2)
        assert [each.name for each in tmp_path.iterdir()] == [source.name]
        assert source.read_bytes() == given
