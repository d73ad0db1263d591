"""A .gltf that is replaced: its old buffer goes only where we made it and nothing else is known to need it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built


@pytest.fixture
def folder(walk: Path, call: Call, tmp_path: Path) -> Path:
    """A folder with walk.gltf and its walk.bin, and nothing else in it or above it."""
    made = tmp_path / "above" / "folder"
    made.mkdir(parents=True)
    call("convert", walk, made / "walk.gltf").product()
    return made


def rename_buffer(folder: Path, name: str) -> bytes:
    """Give the buffer of walk.gltf another name; return its bytes."""
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / "walk.bin").rename(folder / name)
    text = (folder / "walk.gltf").read_text()
    (folder / "walk.gltf").write_text(text.replace('"walk.bin"', json.dumps(name)))
    return (folder / name).read_bytes()


def replace(call: Call, folder: Path) -> str:
    """Write walk.gltf anew; return the notes."""
    run = call("resample", folder / "walk.gltf", folder / "walk.gltf", "--fps", "9")
    assert run.code == 0, run.err
    assert call("inspect", folder / "walk.gltf").code == 0
    return "".join(line for line in run.err.splitlines(keepends=True) if line.startswith("note: "))


def bins(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.suffix == ".bin")


def test_a_buffer_of_another_name_stays_and_a_note_says_so_once(folder: Path, call: Call) -> None:
    data = rename_buffer(folder, "animation.bin")
    notes = replace(call, folder)
    assert notes == "note: 'animation.bin' is not used by walk.gltf any more; delete it if nothing else needs it\n"
    assert (folder / "animation.bin").read_bytes() == data
    assert bins(folder) == ["animation.bin", "walk.bin"]
    run = call("resample", folder / "walk.gltf", folder / "walk.gltf", "--fps", "5")
    assert "note:" not in run.err
    assert len(bins(folder)) == 2


@pytest.mark.parametrize("above", [1, 2, 3])
def test_a_buffer_that_a_file_far_above_uses_stays(above: int, folder: Path, call: Call) -> None:
    place = folder.joinpath(*["deep"] * 3)
    place.mkdir(parents=True)
    for path in (folder / "walk.gltf", folder / "walk.bin"):
        path.rename(place / path.name)
    top = place.parents[above - 1]
    named = json.dumps((place / "walk.bin").relative_to(top).as_posix())
    user = top / "user.gltf"
    user.write_text((place / "walk.gltf").read_text().replace('"walk.bin"', named))
    assert replace(call, place) == ""
    assert len(bins(place)) == 2
    assert call("inspect", user).code == 0


def test_a_buffer_that_a_link_of_its_own_name_leads_to_stays(folder: Path, call: Call) -> None:
    user = folder.parent / "user.gltf"
    user.write_text((folder / "walk.gltf").read_text())
    (folder.parent / "walk.bin").symlink_to("folder/walk.bin")
    assert replace(call, folder) == ""
    assert (folder / "walk.bin").is_file()


@pytest.mark.parametrize("content", [b"{", b'{"buffers": [3, {"uri": 4}], "images": 5}', b"glTF\x02\0\0\0", b"[]"])
def test_invalid_files_far_above_need_no_buffer(content: bytes, folder: Path, call: Call) -> None:
    place = folder / "deep/deep"
    place.mkdir(parents=True)
    for path in (folder / "walk.gltf", folder / "walk.bin"):
        path.rename(place / path.name)
    (folder.parent / "odd.glb").write_bytes(content + b"walk.bin")
    assert replace(call, place) == ""
    assert len(bins(place)) == 1


@pytest.mark.parametrize(
    "line",
    [
        "bake walk.gltf walk.gltf --fps {fps}",
        "convert-cache walk.gltf walk.gltf --fps {fps}",
        "simulate cloth walk.gltf walk.gltf --fps {fps} --duration 0.3",
    ],
)
def test_caches_made_in_place_leave_no_buffers(
    line: str, folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each left one: those of the input were spared, though it was the output too."""
    monkeypatch.chdir(folder)
    Path("arm.glb").write_bytes(built("arm"))
    call("bake", "arm.glb", "walk.gltf", "--clip", "bend", "--fps", "4").product()
    for fps in (6, 8, 6):
        call(*line.format(fps=fps).split()).product()
        assert len(bins(folder)) == 1
        assert call("inspect", "walk.gltf").code == 0


def test_quiet_says_nothing_of_it(folder: Path, call: Call) -> None:
    rename_buffer(folder, "animation.bin")
    assert call("resample", folder / "walk.gltf", folder / "walk.gltf", "--fps", "9", "-q").err == ""


@pytest.mark.parametrize("name", ["walk.bin", "walk-1.bin", "walk-1-2.bin", "walk-0a1b2c3d.bin", "walk-1-0a1b2c3d.bin"])
def test_a_buffer_called_after_its_gltf_goes(name: str, folder: Path, call: Call) -> None:
    rename_buffer(folder, name)
    assert replace(call, folder) == ""
    assert len(bins(folder)) == 1
    assert bins(folder) != [name]


@pytest.mark.parametrize("length", [8, 16, 64])
def test_a_buffer_called_after_its_content_goes(length: int, folder: Path, call: Call) -> None:
    """As that of a .gltf that was renamed."""
    digest = hashlib.sha256((folder / "walk.bin").read_bytes()).hexdigest()
    rename_buffer(folder, f"run-{digest[:length]}.bin")
    assert replace(call, folder) == ""
    assert bins(folder) == ["walk.bin"]


@pytest.mark.parametrize("name", ["run-0a1b2c3d.bin", "walk2.bin", "walk.buffer", "data/walk.bin"])
def test_a_name_that_only_looks_like_ours_stays(name: str, folder: Path, call: Call) -> None:
    data = rename_buffer(folder, name)
    assert f"'{name}' is not used" in replace(call, folder)
    assert (folder / name).read_bytes() == data


def backup(name: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes((folder / "walk.gltf").read_bytes())


def scene_above(folder: Path) -> None:
    text = (folder / "walk.gltf").read_text()
    (folder.parent / "scene.gltf").write_text(text.replace("walk.bin", "folder/walk%2Ebin"))


def escaped(folder: Path) -> None:
    text = (folder / "walk.gltf").read_text()
    (folder / "other.gltf").write_text(text.replace("walk.bin", "w\\u0061lk.bin"))


def link_beside(folder: Path) -> None:
    (folder / "other.bin").symlink_to("walk.bin")


def link_above(folder: Path) -> None:
    (folder.parent / "other.bin").symlink_to(folder / "walk.bin")


@pytest.mark.parametrize(
    "user",
    [
        *map(backup, ("walk.gltf.bak", "walk.gltf~", "walk.old", "copy.GLTF", "walk.json")),
        scene_above,
        escaped,
        link_beside,
        link_above,
    ],
)
def test_a_buffer_that_something_else_needs_stays(user: Callable[[Path], object], folder: Path, call: Call) -> None:
    user(folder)
    data = (folder / "walk.bin").read_bytes()
    assert replace(call, folder) == ""
    assert (folder / "walk.bin").read_bytes() == data


def test_other_files_around_do_not_keep_it(folder: Path, call: Call) -> None:
    for place in (folder, folder.parent):
        (place / "arm.glb").write_bytes(built("arm"))
        (place / "package.json").write_text('{"files": "walk.bin"}')
        (place / "empty.gltf").touch()
        (place / "broken.gltf").write_bytes(b"\0" * 99)
        (place / "nowhere.bin").symlink_to("nothing")
        os.mkfifo(place / "pipe.gltf")
    assert replace(call, folder) == ""
    assert "walk.bin" not in bins(folder)


def test_a_link_as_buffer_stays_with_what_it_leads_to(folder: Path, call: Call) -> None:
    data = (folder / "walk.bin").read_bytes()
    (folder / "walk.bin").rename(folder / "real.bin")
    (folder / "walk.bin").symlink_to("real.bin")
    assert "'walk.bin' is not used" in replace(call, folder)
    assert (folder / "real.bin").read_bytes() == data


def test_a_replaced_gltf_of_another_input_is_handled_alike(folder: Path, walk: Path, call: Call) -> None:
    data = rename_buffer(folder, "animation.bin")
    walk.write_bytes(built("arm"))
    assert "'animation.bin' is not used by walk.gltf" in call("convert", walk, folder / "walk.gltf").err
    assert (folder / "animation.bin").read_bytes() == data
