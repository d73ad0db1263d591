"""Outputs that can't be written are refused before any work."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.errors import OutputError
from anim.files import resolver
from cli.io import documents, output_folders


def test_a_folder_without_permission_is_no_mistake_of_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(path: Path) -> Path:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(resolver, "resolve_links", refused)
    with pytest.raises(OutputError, match="permission denied"):
        documents.check_file("closed/out.glb")


def test_a_folder_that_is_not_there_is_none_either(tmp_path: Path) -> None:
    """As a file that can't be read."""
    with pytest.raises(OutputError, match="there is no folder"):
        documents.check_file(str(tmp_path / "missing" / "out.glb"))


def test_the_folder_of_a_name_that_is_filled_in_is_made_later(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    documents.check_file(str(tmp_path / "new" / "{clip}.npz"), ("clip",))
    documents.check_file(str(tmp_path / "new" / "sub" / "walk.npz"), None, makes_folder=True)
    with pytest.raises(OutputError, match="file' is no folder"):
        documents.check_file(str(tmp_path / "file" / "{clip}.npz"), ("clip",))
    with pytest.raises(OutputError, match="there is no folder") as error:
        documents.check_file(str(tmp_path / "new" / "walk.npz"), ("clip",))
    assert error.value.help.startswith("make it first")
    assert sorted(tmp_path.iterdir()) == [tmp_path / "file"]


def test_a_folder_on_a_drive_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows has roots that don't exist; here they do."""
    monkeypatch.setattr(Path, "exists", lambda path: False)
    with pytest.raises(OutputError, match=r"^/new/\{clip\}.npz: there is no '/'$"):
        output_folders.check_missing("/new/{clip}.npz", Path("/new"), is_made=True)
