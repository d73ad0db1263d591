"""Outputs by the name of what is open already are written into, after what is there."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.running import built, shell


@pytest.mark.parametrize("way", ["> out", ">> out", "| cat > out"])
def test_stdout_by_its_path_takes_what_stdout_takes(way: str, tmp_path: Path) -> None:
    """What is there before stays; a file is no pipe, and is not replaced."""
    (tmp_path / "in.glb").write_bytes(built("arm"))
    shell(f"(echo hi; gltf-anim convert in.glb /dev/stdout -q) {way}", tmp_path).product()
    shell("gltf-anim convert in.glb - -q > plain", tmp_path).product()
    assert (tmp_path / "out").read_bytes() == b"hi\n" + (tmp_path / "plain").read_bytes()


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("sample in.glb OUT --at 0 -q", "/proc/self/fd/1"),
        ("plot --ease quad-in OUT --format svg -q", "/dev/stdout"),
        ("optimize in.glb o.glb --effort fast -q --report OUT", "/dev/fd/1"),
        ("check in.glb --write-baseline OUT", "/dev/stdout"),
        ("convert in.glb OUT -q", "/dev/fd/3"),
        ("bake in.glb OUT --fps 4 --clip bend --format npz -q", "/dev/fd/3"),
        ("convert in.glb OUT -q", "//dev/stdout"),
        ("convert in.glb OUT -q", "link"),
        ("bake in.glb OUT --fps 4 --clip bend --format npz -q", "link.npz"),
        ("plot --ease quad-in OUT --format svg -q", "devices/stdout"),
    ],
)
def test_what_is_open_already_is_written_after_what_is_there(line: str, place: str, tmp_path: Path) -> None:
    (tmp_path / "in.glb").write_bytes(built("arm"))
    (tmp_path / "devices").symlink_to("/dev")
    for name in ("link", "link.npz"):
        (tmp_path / name).symlink_to("devices/stdout")
    alone = "gltf-anim " + line.replace("OUT", "alone.glb" if line.startswith("convert") else "alone")
    expected = shell(f"{alone} >&2 && cat alone*", tmp_path).product()
    command = "gltf-anim " + line.replace("OUT", place)
    done = shell(f"(echo hi; {command}; echo bye) > out 3>&1", tmp_path)
    assert done.code == 0, done.err
    found = (tmp_path / "out").read_bytes()
    assert (found[:3], found[-4:]) == (b"hi\n", b"bye\n")
    if "--report" not in line:  # which tells the time
        assert found[3:-4] == expected
