"""`anim.page`: an asset or a cache as one HTML file that plays it, or two of them compared."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import TypeAlias

from anim.asset import Asset, PathName, as_asset
from anim.errors import AnimError, RangeError, check_number, check_type
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from anim.model import VertexCache
from anim.operations.selection import not_found
from anim.show.page.bakes import bake_content, with_left_out
from anim.show.page.comparison import compare_clips, compare_content
from anim.show.page.notebook import cache_file, document_file
from anim.show.page.page import EMPTY, SHOWS, PageContent, PageFile, PageView
from anim.show.page.page import page as make_page
from anim.show.page.paired_meshes import pair_cache_meshes

NOT_SHOWN = "Only the meshes in the cache are shown."
Shown: TypeAlias = Asset | Document | PathName | VertexCache


def page(
    asset: Shown,
    other: Shown | None = None,
    *,
    title: str = "",
    clip: str | int | None = None,
    node: str | None = None,
    time: float | None = None,
    show: Sequence[str] = (),
) -> bytes:
    """Return an HTML page that plays an asset or a vertex cache, or compares two: one file without any network.

    title: the names of the files by default. clip: a name or an index; node: a name; time: seconds to pause at; show:
    names of what is seen first: "bones", "wire", "onion", "clay", "curves", "heat". With `other`, the page shows the
    largest error of each clip, and errors over time. The same arguments give the same bytes.
    Raises NotFoundError for an unknown clip or node, RangeError for another name in `show`, UnsupportedError for an
    installation without pages.
    Path("walk.html").write_bytes(page("walk.glb", "small.glb", clip="walk", show=["heat"]))
    """
    check_type(title, str, "title")
    file = _file(asset)
    view = _view(file, clip, node, time, show)
    second = None if other is None else _file(other)
    content = EMPTY if second is None else _compare(file, second)
    return make_page(file, second, title=title, view=view, content=content)


def _file(value: Shown) -> PageFile:
    if isinstance(value, VertexCache):
        return cache_file(value)
    asset = as_asset(value)
    return document_file(asset.document, asset.source)


def _view(
    file: PageFile, clip: str | int | None, node: str | None, time: float | None, show: Sequence[str]
) -> PageView:
    """State of the page when it opens. Raises NotFoundError and RangeError."""
    check_type(show, Collection, "show")
    if unknown := [name for name in show if name not in SHOWS]:
        raise RangeError(f"`show` has {unknown[0]!r} (expected {', '.join(SHOWS)})")
    time = None if time is None else check_number(time, "time")
    if time is not None and not (math.isfinite(time) and time >= 0):
        raise RangeError(f"`time` is {time} (expected seconds, 0 or more)")
    asset = Asset(file.document)
    names = [asset.skeleton.display_name(i) for i in range(len(asset.skeleton))]
    if node is not None and node not in names:
        raise not_found(node, names, "node")
    return PageView(None if clip is None else asset.clips.names[asset.clips.index_of(clip)], node, time, tuple(show))


def _compare(one: PageFile, other: PageFile) -> PageContent:
    """Errors over time, where both can be measured by joints; else the page compares vertices by itself."""
    clips = reader.clips(one.document), reader.clips(other.document)
    if one.cache is not None or other.cache is not None:
        partners = {0: 0} if len(clips[0]) and len(clips[1]) == 1 else {}
        source = other if other.cache is None else one
        content = bake_content(source, pair_cache_meshes(one, other), partners, is_first=source is one)
        return with_left_out(content, reader.scene(source.document), NOT_SHOWN) if any(content.hidden) else content
    try:
        scenes = reader.scene(one.document), reader.scene(other.document)
        ruler = ErrorMetric(*scenes, clips=clips[0] + clips[1])
        pairs = compare_clips(ruler, *clips)
    except AnimError:
        return EMPTY
    return compare_content(ruler, *clips, pairs)
