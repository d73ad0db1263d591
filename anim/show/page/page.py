"""A self-contained HTML page that plays one file, or compares two."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import string
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, TypeAlias

from anim.errors import AnimError
from anim.gltf.document import Document
from anim.gltf.io.buffers import Resolve
from anim.model import VertexCache
from anim.show.page.embedding import Embedded, embed
from anim.show.page.resources import START, STYLE, TEMPLATE, read_script, read_text

SHOWS = ("bones", "wire", "onion", "clay", "curves", "heat")
COMPRESSION = 9
MeshNodes: TypeAlias = tuple[int, ...] | None
# Nothing but the page's own two scripts, known by their hashes, runs; nothing is loaded from anywhere
POLICY = (
    "default-src 'none'; script-src {scripts} 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src data: blob:; base-uri 'none'; form-action 'none'"
)


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file on a page.

    document: what is shown. name: for headings. size: bytes of the file, 0 if unknown. notes: lines about differences
    to the file, beside those of `embed`. resolve: see `embed`. cache: the vertex cache that the document was made of.
    """

    document: Document
    name: str
    size: int = 0
    notes: tuple[str, ...] = ()
    resolve: Resolve | None = None
    cache: VertexCache | None = None


@dataclass(frozen=True, slots=True)
class PageView:
    """State of the page when it opens: names of clip and node, time in s, names in SHOWS. None: paused at no time."""

    clip: str | None = None
    node: str | None = None
    time: float | None = None
    show: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PageLink:
    """Position that a row of a panel links to: indices of a clip and a node of the first file, time in s."""

    clip: int | None = None
    node: int | None = None
    time: float | None = None


@dataclass(frozen=True, slots=True)
class PageRow:
    """A row of a panel: its cells and link; its level: "error", "warning", "info" or ""; text and advice below.

    parts: labels and links of what the row sums up.
    """

    cells: tuple[str, ...]
    link: PageLink | None = None
    level: str = ""
    text: str = ""
    advice: str = ""
    parts: tuple[tuple[str, PageLink], ...] = ()


@dataclass(frozen=True, slots=True)
class PagePanel:
    """A table beside the picture. hot: index of the column with errors. about: a sentence on all rows."""

    title: str
    rows: tuple[PageRow, ...]
    count: str = ""
    hot: int = -1
    about: str = ""


@dataclass(frozen=True, slots=True)
class ClipFigure:
    """A figure about a clip, as text and as a number to sort clips by."""

    label: str
    text: str
    value: float


@dataclass(frozen=True, slots=True)
class ClipError:
    """Error of one clip over time.

    max: the largest error, in m. times, errors: the curve, in s and m; empty for one that the page does not draw.
    joint: the node nearest to the largest error, "" where vertices were compared. time: of the largest error, in s.
    """

    max: float
    times: tuple[float, ...] = ()
    errors: tuple[float, ...] = ()
    joint: str = ""
    time: float = 0.0


@dataclass(frozen=True, slots=True)
class PageContent:
    """Contents of a page besides its files.

    errors, figures: by index of a clip of the first file. partners: indices of the second file's clips by those of
    the first.
    meshes: nodes of each file whose meshes correspond vertex by vertex, in this order; None: all meshes of a file.
    Without `meshes` the page pairs meshes by name and number of vertices.
    hidden: nodes of each file whose meshes are not shown.
    """

    subtitle: str = ""
    panels: Sequence[PagePanel] = ()
    errors: Mapping[int, ClipError] = field(default_factory=dict)
    partners: Mapping[int, int] = field(default_factory=dict)
    meshes: tuple[MeshNodes, MeshNodes] | None = None
    figures: Mapping[int, Sequence[ClipFigure]] = field(default_factory=dict)
    hidden: tuple[tuple[int, ...], tuple[int, ...]] = ((), ())


EMPTY = PageContent()
START_VIEW = PageView()


def page(
    file: PageFile,
    other: PageFile | None = None,
    *,
    title: str = "",
    view: PageView = START_VIEW,
    content: PageContent = EMPTY,
) -> bytes:
    """Return an HTML page that plays `file`, or `file` beside `other`, without any other file or network.

    title: the names of the files by default. The same arguments give the same bytes.
    Raises FormatError or UnsupportedError, with its name, for a file that can't be shown, UnsupportedError without the
    page's script.
    """
    script, start = read_script(), read_text(START)
    shown = [file] if other is None else [file, other]
    embedded = [_embed(each) for each in shown]
    files = [
        {"name": each.name, "bytes": each.size, "notes": [*each.notes, *made.notes], **_kind(each)}
        for each, made in zip(shown, embedded, strict=True)
    ]
    facts = {"files": files, "view": _view(view), **_content(content)}
    names = [each.name for each in shown]
    return (
        string.Template(read_text(TEMPLATE))
        .substitute(
            policy=POLICY.format(scripts=" ".join(map(_hash, (start, script)))),
            title=html.escape(title or " | ".join(names)),
            subtitle=html.escape(content.subtitle),
            style=read_text(STYLE),
            tag_a=html.escape(names[0]),
            tag_b=html.escape(names[-1]),
            code=_packed(script.encode()),
            a=_packed(embedded[0].glb),
            b=_packed(embedded[1].glb) if other is not None else "",
            facts=_json(facts),
            start=start,
        )
        .encode(errors="replace")
    )


def _embed(file: PageFile) -> Embedded:
    """The document as the page holds it; errors name the file."""
    try:
        return embed(file.document, file.resolve)
    except AnimError as error:
        raise error.at(file.name, ": ") from None


def _packed(data: bytes) -> str:
    """Gzip in base64, which the page inflates; without a time stamp, so that the same data give the same text."""
    return base64.b64encode(gzip.compress(data, COMPRESSION, mtime=0)).decode()


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _json(value: Any) -> str:
    """JSON that can't end the script element it is in."""
    return json.dumps(value, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _view(view: PageView) -> dict[str, Any]:
    named = {"clip": view.clip, "node": view.node, "t": view.time, "show": list(view.show)}
    return {name: value for name, value in named.items() if value not in (None, [])}


def _kind(file: PageFile) -> dict[str, bool]:
    return {} if file.cache is None else {"cache": True}


def _content(content: PageContent) -> dict[str, Any]:
    return {
        "panels": [_panel(each) for each in content.panels],
        "errors": {
            i: {"max": each.max, "times": each.times, "errors": each.errors} for i, each in content.errors.items()
        },
        "partners": dict(content.partners),
        "figures": {i: [asdict(each) for each in figures] for i, figures in content.figures.items()},
        **({} if content.meshes is None else {"meshes": content.meshes}),
        **({"hidden": content.hidden} if any(content.hidden) else {}),
    }


def _panel(panel: PagePanel) -> dict[str, Any]:
    rows = [
        {
            "cells": row.cells,
            "level": row.level,
            **({"text": row.text, "advice": row.advice} if row.text else {}),
            **({"link": asdict(row.link)} if row.link else {}),
            **({"parts": [{"label": label, "link": asdict(link)} for label, link in row.parts]} if row.parts else {}),
        }
        for row in panel.rows
    ]
    return {"title": panel.title, "count": panel.count, "hot": panel.hot, "about": panel.about, "rows": rows}
