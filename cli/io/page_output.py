"""Pages as outputs of commands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath

from anim.files import resolver
from anim.gltf.document import Document
from anim.show.page.page import EMPTY, START_VIEW, PageContent, PageFile, PageView, page
from anim.show.page.resources import read_script
from cli.errors import UsageError
from cli.io import documents, stdout
from cli.streams import locate
from cli.text import Reporter, format_bytes

PAGE_SUFFIXES = (".html", ".htm")


def check_page(path: str, option: str = "") -> None:
    """Raise before any work if no page can be written to `path`: UsageError, or UnsupportedError without its script.

    option: which the path is given by, for the message.
    """
    read_script()
    if path == documents.PIPE:
        return
    documents.check_file(path)
    if not path.lower().endswith(PAGE_SUFFIXES):
        prefix = f"{option}: " if option else ""
        raise UsageError(f"{prefix}{path}: is no .html file (expected a name such as page.html)")


def page_file(path: str, document: Document, size: int) -> PageFile:
    """Return a file that a command has read, for a page; from a pipe, which can't be read again, its document."""
    if path == documents.PIPE:
        return PageFile(document, "stdin", size)
    beside = resolver.CompanionFiles(Path(locate(path)).parent).open
    return PageFile(document, PurePath(path).name, size, resolve=beside)


def write_page(
    path: str,
    file: PageFile,
    other: PageFile | None,
    reporter: Reporter,
    *,
    content: PageContent = EMPTY,
    view: PageView = START_VIEW,
) -> None:
    """Write a page, and report its size."""
    with commit_page_after(path, page(file, other, view=view, content=content), reporter):
        pass


@contextmanager
def commit_page_after(path: str, made: bytes, reporter: Reporter, *, dry_run: bool = False) -> Iterator[None]:
    """Replace a page's file after the block, or not at all if the block fails; report its size. made: the page."""
    if dry_run:
        yield
        return
    if path == documents.PIPE:
        stdout.check_no_terminal()
    with documents.commit_text_after(made, path):
        yield
    reporter.info(f"{path}  {format_bytes(len(made))}")
