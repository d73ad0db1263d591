"""Copies of images: another process may make the same one at the same time."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from anim.files import atomic, resolver
from anim.gltf.io import images
from anim.gltf.io.source import open_file, write_file
from tests.calls import count_calls

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
    assert images.write_copies({copy: source}) == (other == PNG)
    assert copy.read_bytes() == other
    assert os.listdir(copy.parent) == ["skin.png"]


@pytest.mark.parametrize("ending", [".gltf", ".glb"])
def test_an_image_whose_name_another_process_takes_meanwhile_gets_another_one(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files of one run may have different textures of one name, from several folders; it failed for some of them."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in/skin.png").write_bytes(PNG)
    (tmp_path / "in/a.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "skin.png"}]}))
    out, other = tmp_path / "out", PNG + b"other"
    write = atomic.write_temporary

    def written(*args: object, **options: object) -> Path:
        (out / "skin.png").write_bytes(other)
        return write(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(atomic, "write_temporary", written)
    source = open_file(str(tmp_path / "in/a.gltf"))
    out.mkdir()
    write_file(source.document, str(out / f"a{ending}"), source)
    (image,) = open_file(str(out / f"a{ending}")).document.json["images"]
    assert image["uri"] != "skin.png"
    assert (out / image["uri"]).read_bytes() == PNG
    assert (out / "skin.png").read_bytes() == other
    assert len(list(out.iterdir())) == 3


def test_links_are_resolved_only_of_images_that_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "there.png").write_bytes(PNG)
    (tmp_path / "dangling.png").symlink_to(tmp_path / "nowhere.png")
    counted = count_calls(monkeypatch, resolver, "locate")
    names = [*(f"{i}.png" for i in range(100)), "there.png", "dangling.png", "../there.png", "a%00.png"]
    found = [images.locate_image(tmp_path, {"uri": name}) for name in names]
    assert [each for each in found if each is not None] == [tmp_path / "there.png"]
    assert len(counted) == 2
