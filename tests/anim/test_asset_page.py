"""`anim.page` and pages in notebooks: the same bytes, in a frame that lets nothing out."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import anim
from anim.errors import NotFoundError, RangeError, ShapeError, UnsupportedError
from anim.show.page import notebook
from anim.show.page import page as page_module
from tests.pages import needs_page


class _Frames(HTMLParser):
    """Start tags with their attributes, and the text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data


def _facts(page: bytes) -> Any:
    found = re.search(rb'<script type="application/json" id="facts">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


def _asset_frame(value: Any) -> tuple[dict[str, str | None], str]:
    """The attributes of the one frame that a value shows, and its content."""
    frames = _Frames(value._repr_html_()).tags
    assert [tag for tag, _ in frames] == ["iframe"]
    attributes = frames[0][1]
    content = attributes.pop("srcdoc")
    assert content is not None
    return attributes, content


@needs_page
def test_an_asset_shows_its_page(biped: Path, tmp_path: Path) -> None:
    path = tmp_path / '"><script>alert(1)<!--.glb'.replace("/", "")
    path.write_bytes(biped.read_bytes())
    asset = anim.load(path)
    attributes, content = _asset_frame(asset)
    assert content.encode() == anim.page(asset) == anim.page(path)
    assert attributes["sandbox"] == "allow-scripts"
    assert attributes["title"] == repr(asset)
    assert _facts(content.encode())["files"][0] | {"notes": []} == {
        "name": path.name, "bytes": path.stat().st_size, "notes": [],
    }  # fmt: skip


@needs_page
def test_a_cache_shows_its_page(biped: Path) -> None:
    cache = anim.bake(biped, fps=10)
    _, content = _asset_frame(cache)
    assert content.encode() == anim.page(cache)
    assert _facts(content.encode())["files"][0]["notes"][0].startswith("morph targets: within ")


@needs_page
def test_images_beside_the_file_are_packed_in(asset: Callable[[str], Path]) -> None:
    page = anim.page(asset("CesiumMan-gltf/CesiumMan.gltf"))
    assert len(page) > 400_000
    assert _facts(page)["files"][0]["notes"] == []
    assert b"://" not in re.sub(rb'<script type="text/plain".*?</script>', b"", page, flags=re.DOTALL)


@needs_page
def test_two_assets_are_compared(biped: Path) -> None:
    asset = anim.load(biped)
    other = asset.map_clips(lambda clip: anim.ops.resample(clip, fps=5))
    page = anim.page(asset, other, title="</title>", clip=1, node="head", time=0.25, show=["heat", "bones"])
    facts = _facts(page)
    assert facts["view"] == {"clip": asset.clips.names[1], "node": "head", "t": 0.25, "show": ["heat", "bones"]}
    largest = anim.diff(asset, other).max_error
    assert max(each["max"] for each in facts["errors"].values()) == pytest.approx(largest)
    assert b"<title>&lt;/title&gt;</title>" in page
    assert len(facts["files"]) == 2
    baked = _facts(anim.page(asset, anim.bake(asset, fps=10)))
    assert baked["files"][1]["name"] == "cache"
    assert not baked["errors"], "joints of a cache cannot be compared; the page compares vertices"
    assert baked["partners"] == {"0": 0}


@needs_page
@pytest.mark.parametrize(
    ("options", "kind", "problem"),
    [
        ({"clip": "dance"}, NotFoundError, "dance"),
        ({"clip": 99}, NotFoundError, "99"),
        ({"node": "tail"}, NotFoundError, "no node matches 'tail'"),
        ({"show": ["x-ray"]}, RangeError, "x-ray"),
        ({"time": float("nan")}, RangeError, "time"),
        ({"time": -1.0}, RangeError, "time"),
        ({"title": 5}, ShapeError, "title"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, Any], kind: type[Exception], problem: str, biped: Path) -> None:
    with pytest.raises(kind, match=problem):
        anim.page(biped, **options)


def test_without_the_script_a_notebook_shows_the_words(biped: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> str:
        raise UnsupportedError("no <script>", help="build & try again")

    monkeypatch.setattr(page_module, "read_script", refuse)
    asset = anim.load(biped)
    found = _Frames(asset._repr_html_())
    assert [tag for tag, _ in found.tags] == ["pre"]
    assert found.text == f"{asset!r}\n\nno page: no <script>\nbuild & try again"
    with pytest.raises(UnsupportedError):
        anim.page(asset)


def test_a_page_too_large_for_a_notebook_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "MAX_PAGE_BYTES", 1_000_000)
    assert "the page has 2 MB" in notebook.frame(lambda: bytes(2_000_000), "asset")
    assert "<iframe" in notebook.frame(lambda: b"page", "asset")


def test_an_edited_asset_is_checked_first(biped: Path) -> None:
    asset = anim.load(biped)
    asset.document.json["nodes"][0]["rotation"] = [np.nan]
    assert "no page: " in asset._repr_html_()
