"""The reference of commands is the commands' own, and every command of the pages runs and prints what they show."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from docs import generate, pages
from tests.pages import missing

RENEW = "docs/ is not current: run `python -m docs.generate`, or `make docs` for the pages"
NUMBER = re.compile(r"[-+−]?\d+(\.\d+)?(e[-+]?\d+)?")  # in another version of numpy the last digit may differ
LINK = re.compile(r"(?<!!)\[[^\]]+\]\(([^)#:]+)\)")
MAX_PICTURES_BYTES = 1_500_000
SLOW_PAGES = ("examples", "recipes", "simulation")
MAX_PAGE_LINES = 120


def test_the_reference_is_current(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")  # no terminal shows in it
    assert generate.REFERENCE.read_text(encoding="utf-8") == generate.reference(), RENEW


def test_the_reference_names_every_option() -> None:
    text = generate.reference()
    for option in (
        "`--fps N`: Frames per second",
        "`-q, --quiet`",
        "(required)",
        "`--follow / --no-follow`",
        "to 3000",
    ):
        assert option in text


def page_cases() -> Iterator[Any]:
    """All pages; those whose commands take some seconds are left out of the quick set."""
    for page in pages.PAGES:
        yield pytest.param(page, id=page.stem, marks=[pytest.mark.slow] if page.stem in SLOW_PAGES else [])


@pytest.mark.parametrize("page", list(page_cases()))
def test_a_page_shows_what_its_commands_print_and_draw(page: Path, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if "gltf-anim view" in text and missing():
        pytest.skip(missing())
    pages.write_inputs(tmp_path)
    assert _without_numbers(pages.updated(text, tmp_path)) == _without_numbers(text), RENEW
    for picture in pages.pictures(text):
        assert (tmp_path / picture).is_file(), f"no command of this page writes {picture}"
        assert (pages.PICTURES / picture).is_file(), RENEW


@pytest.mark.parametrize("page", [pytest.param(page, id=page.stem) for page in pages.PAGES])
def test_links_lead_to_files_and_pages_are_short(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert [link for link in LINK.findall(text) if not (page.parent / link).exists()] == []
    assert len(text.splitlines()) <= MAX_PAGE_LINES or page.stem == "examples", "shorten it, or make it two pages"


def test_the_index_names_every_page() -> None:
    linked = {(pages.DOCS / link).resolve() for link in LINK.findall((pages.DOCS / "README.md").read_text("utf-8"))}
    assert {*pages.PAGES, generate.REFERENCE} - {pages.DOCS / "README.md"} <= linked


def test_pictures_are_shown_and_small() -> None:
    files = {path.name for path in pages.PICTURES.glob("*")}
    assert files == {name for page in pages.PAGES for name in pages.pictures(page.read_text("utf-8"))}, RENEW
    assert sum(path.stat().st_size for path in pages.PICTURES.glob("*")) < MAX_PICTURES_BYTES


def test_a_command_that_fails_is_an_error(tmp_path: Path) -> None:
    assert pages.commands("one \\\n  two # three\n\n# four\n") == ["one two"]
    with pytest.raises(RuntimeError, match="exit 3"):
        pages.updated("```sh\nexit 3\n```", tmp_path)
    assert pages.updated("```sh\necho 1, took 2 s\n```\n\n```text\n```", tmp_path).endswith("```text\n1\n```")


def _without_numbers(text: str) -> str:
    return " ".join(NUMBER.sub("0", text).split())
