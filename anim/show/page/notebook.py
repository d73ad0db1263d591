"""Pages in notebooks: values of the library as files of a page, in a frame."""

from __future__ import annotations

import html
from collections.abc import Callable
from pathlib import PurePath

from anim.errors import AnimError
from anim.files import resolver
from anim.gltf.document import Document
from anim.gltf.io.source import Source
from anim.model import VertexCache
from anim.show.page.page import PageFile
from anim.show.page.sources import convert_cache

HEIGHT_PX = 540
MAX_PAGE_BYTES = 24_000_000  # in a cell's output; notebooks are saved with it


def document_file(document: Document, source: Source | None = None) -> PageFile:
    """Return a document as a file of a page, with the images beside the input it was read from."""
    if source is None:
        return PageFile(document, "asset")
    beside = None if source.folder is None else resolver.CompanionFiles(source.folder).open
    return PageFile(document, PurePath(source.name).name, source.size, resolve=beside)


def cache_file(cache: VertexCache, name: str = "cache") -> PageFile:
    """Return a vertex cache as a file of a page. Raises UnsupportedError for one that is too large."""
    converted = convert_cache(cache, name)
    return PageFile(converted.document, name, notes=tuple(converted.notes), cache=cache)


def frame(make: Callable[[], bytes], text: str) -> str:
    """Return HTML that shows the page of `make` in a notebook; else `text`, and why there is no page."""
    try:
        page = make()
    except AnimError as error:
        return _plain(text, f"{error}\n{error.help}".strip())
    if len(page) > MAX_PAGE_BYTES:
        return _plain(text, f"the page has {len(page) / 1e6:.0f} MB: write it with anim.page and open the file")
    content = html.escape(page.decode(), quote=True)
    return (
        f'<iframe title="{html.escape(text, quote=True)}" srcdoc="{content}" sandbox="allow-scripts" '
        f'style="width: 100%; height: {HEIGHT_PX}px; border: 0"></iframe>'
    )


def _plain(text: str, problem: str) -> str:
    return f"<pre>{html.escape(text)}\n\nno page: {html.escape(problem)}</pre>"
