"""Copies of images: another process may make the same one at the same time."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from anim.errors import OutputError
from anim.files import atomic
from anim.gltf.io import images

PNG = b"\x89PNG\r\n\x1a\n" + bytes(100)


@pytest.mark.parametrize("other", [PNG, PNG + b"other"])
def test_a_copy_that_another_process_makes_meanwhile(
    other: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files of one run often share a texture: it failed for some of them."""
    source, copy = tmp_path / "skin.png", tmp_path / "out" / "skin.png"
    source.write_bytes(PNG)
    write = atomic.write_temporary

    def written(*args: object, **options: object) -> Path:
        copy.write_bytes(other)
        return write(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(atomic, "write_temporary", written)
    if other == PNG:
        images.write_copies({copy: source})
    else:
        with pytest.raises(OutputError):
            images.write_copies({copy: source})
    assert copy.read_bytes() == other
    assert os.listdir(copy.parent) == ["skin.png"]
