"""Paths that name what the process has open, however they are written."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from anim.errors import OutputError
from anim.files.special_files import descriptor_of
from anim.gltf.io.source import open_bytes, write_file
from tests.cli.running import built


@pytest.mark.parametrize(
    ("path", "number"),
    [
        ("/dev/stdout", 1),
        ("//dev/stderr", 2),
        ("/dev/../dev/./fd/3", 3),
        ("/proc/{pid}/fd/12", 12),
        ("/proc/thread-self/fd/1", 1),
        ("/dev/null", None),
        ("/dev/stdin", 0),
        ("/dev/fd/x", None),
        ("stdout", None),
    ],
)
def test_every_name_of_an_open_file_is_known(path: str, number: int | None) -> None:
    assert descriptor_of(Path(path.format(pid=os.getpid()))) == number


def test_links_to_an_open_file_are_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a").symlink_to("/dev/stdout")
    Path("b").symlink_to("a")
    Path("loop").symlink_to("loop")
    assert [descriptor_of(Path(name)) for name in ("a", "b", "loop", "none")] == [1, 1, None, None]


def test_a_pair_of_files_is_not_written_where_a_link_leads_to_an_open_file(tmp_path: Path) -> None:
    document = open_bytes(np.frombuffer(built("arm"), np.uint8), "arm").document
    with (tmp_path / "open").open("wb") as file:
        (tmp_path / "out.gltf").symlink_to(f"/dev/fd/{file.fileno()}")
        with pytest.raises(OutputError, match="is no plain file"):
            write_file(document, str(tmp_path / "out.gltf"), None)
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["open", "out.gltf"]
