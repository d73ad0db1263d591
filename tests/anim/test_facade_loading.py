"""`anim.load`: paths, bytes and files, and what stays of them."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import anim


def test_paths_bytes_and_files_load_alike(biped: Path) -> None:
    data = biped.read_bytes()
    for given in (str(biped), data, bytearray(data), memoryview(data), np.frombuffer(data, np.uint8), io.BytesIO(data)):
        out = io.BytesIO()
        anim.save(anim.load(given), out)
        assert out.getvalue() == data


@pytest.mark.parametrize("kind", [bytearray, memoryview, np.ndarray])
def test_an_asset_does_not_share_memory_that_can_change(kind: Any, biped: Path) -> None:
    """A reader's buffer, used again for the next file, changed the figure."""
    data = biped.read_bytes()
    buffer = bytearray(data)
    given: Any = {bytearray: buffer, memoryview: memoryview(buffer), np.ndarray: np.frombuffer(buffer, np.uint8)}[kind]
    asset = anim.load(given)
    buffer[len(buffer) // 2 :] = bytes(len(buffer) - len(buffer) // 2)
    np.testing.assert_array_equal(anim.sample(asset, "walk"), anim.sample(anim.load(data), "walk"))
    out = io.BytesIO()
    asset.save(out)
    assert out.getvalue() == data


def test_bytes_that_are_not_contiguous_load(biped: Path) -> None:
    data = biped.read_bytes()
    spread = bytearray(2 * len(data))
    spread[::2] = data
    assert len(anim.load(memoryview(spread)[::2]).clips) == len(anim.load(data).clips)
    assert len(anim.load(np.frombuffer(spread, np.uint8)[::2]).clips) == len(anim.load(data).clips)


@pytest.mark.parametrize("content", ["short", "zeros"])
def test_a_file_rewritten_in_place_does_not_change_what_was_loaded(content: str, biped: Path) -> None:
    """The interpreter was killed by SIGBUS: the pages of a mapped file were gone. So in a process of its own."""
    lines = (
        "import io, sys, anim",
        f"path = {str(biped)!r}",
        "data = open(path, 'rb').read()",
        "asset = anim.load(path)",
        f"other = b'short' if {content!r} == 'short' else data[: len(data) // 2].ljust(len(data), b'0')",
        "open(path, 'wb').write(other)",
        "out = io.BytesIO()",
        "asset.save(out)",
        "assert out.getvalue() == data",
        "assert (anim.sample(asset, 'walk') == anim.sample(anim.load(data), 'walk')).all()",
    )
    run = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, (run.returncode, run.stderr)


def test_a_file_that_fails_to_be_read_is_an_error_of_ours() -> None:
    class Failing(io.BytesIO):
        def read(self, size: int | None = -1) -> bytes:
            raise OSError(5, "Input/output error")

    with pytest.raises(anim.FormatError, match=r"can't be read \(input/output error\)"):
        anim.load(Failing())


def test_a_gltf_gets_its_bin_beside_it_and_loads_from_there(biped: Path, tmp_path: Path) -> None:
    asset = anim.load(biped)
    asset.save(tmp_path / "walk.gltf")
    again = anim.load(tmp_path / "walk.gltf")
    assert {path.name for path in tmp_path.iterdir()} == {"biped.glb", "walk.gltf", "walk.bin"}
    assert anim.diff(asset, again).max_error == 0
    other = tmp_path / "other"
    other.mkdir()
    again.save(other / "copy.gltf")
    assert {path.name for path in other.iterdir()} == {"copy.gltf", "copy.bin"}


@pytest.mark.parametrize("address", ["../secret.bin", "/etc/hostname", "link.bin", "%2e%2e/secret.bin"])
def test_buffers_stay_in_the_folder_of_a_gltf(address: str, biped: Path, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    anim.load(biped).save(folder / "walk.gltf")
    (folder / "walk.bin").rename(tmp_path / "secret.bin")
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    content = json.loads((folder / "walk.gltf").read_text())
    content["buffers"][0]["uri"] = address
    (folder / "walk.gltf").write_text(json.dumps(content))
    with pytest.raises(anim.FormatError):
        list(anim.load(folder / "walk.gltf").clips)


def test_bytes_have_no_folder(biped: Path, tmp_path: Path) -> None:
    anim.load(biped).save(tmp_path / "walk.gltf")
    with pytest.raises(anim.FormatError, match="lies beside the file, but bytes have no folder"):
        list(anim.load((tmp_path / "walk.gltf").read_bytes()).clips)
