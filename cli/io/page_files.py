"""Inputs of pages: glTF, vertex caches, and Euler curves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath

from anim.arrays import Bytes
from anim.caches.formats import flipbook_reader
from anim.caches.options import ReadOptions
from anim.caches.registry import CACHE_FORMATS, SIGNATURE_BYTES, reader_for, sniff_format
from anim.caches.storage import Memory, suffix
from anim.exchange.formats.registry import of_path
from anim.files import resolver
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.io.buffers import Resolve
from anim.gltf.io.source import open_bytes
from anim.model import VertexCache
from anim.show.page.page import PageFile
from anim.show.page.sources import PageSource, convert_cache, read_curves
from cli.io import cache_files, documents
from cli.io.cache_folders import StagedFolder
from cli.text import Reporter

GLTF = (".glb", ".gltf")


def open_page_file(path: str, reporter: Reporter) -> PageFile:
    """Return the file at `path`, "-" for stdin, for a page; its format by file extension, else by its first bytes."""
    if path == documents.PIPE:
        with documents.content(path) as (data, name):
            return _of_pipe(data, name, reporter)
    if of_path(path) is not None:
        with documents.content(path, ending=suffix(path)) as (data, name):
            return _converted(read_curves(data.tobytes(), name=PurePath(name).name), name, len(data))
    if suffix(path) in CACHE_FORMATS and suffix(path) not in GLTF:
        return _read_cache(path, reporter)
    with documents.source(path, reporter) as source:
        beside = None if source.folder is None else resolver.CompanionFiles(source.folder).open
        return _of_document(source.document, source.name, source.size, beside)


def open_staged_file(path: str, staged: StagedFolder, reporter: Reporter) -> PageFile:
    """Return a written cache or bake for a page, before its files are renamed. path: its later name."""
    if suffix(path) in GLTF:
        source = open_bytes(staged.resolve(staged.main), path, resolve=staged.resolve)
        return _of_document(source.document, source.name, source.size, staged.resolve)
    return _read_cache(path, reporter, staged)


def _read_cache(path: str, reporter: Reporter, staged: StagedFolder | None = None) -> PageFile:
    with cache_files.load(path, ReadOptions(), staged=staged) as loaded:
        for words in loaded.notes:
            reporter.warn(words)
        return _of_cache(loaded.cache, loaded.name, loaded.size)


def _of_pipe(data: Bytes, name: str, reporter: Reporter) -> PageFile:
    head = data[:SIGNATURE_BYTES].tobytes()
    if head.startswith(b"glTF") or not len(data) or _is_gltf_text(data):
        document = container.read(data, resolver.refuse_relative)
        documents.repaired_note(document, name, reporter)
        return _of_document(document, name, len(data), resolver.refuse_relative)
    if head.lstrip().upper().startswith(b"HIERARCHY") or head.lstrip()[:1] == b"{":
        return _converted(read_curves(data.tobytes()), name, len(data))
    ending = sniff_format(head, len(data))
    cache_files.check_pipe(name, ending)
    cache = reader_for(ending)(Memory(name, {name: data.tobytes()}), ReadOptions(note=reporter.warn))
    return _of_cache(cache, name, len(data))


def _is_gltf_text(data: Bytes) -> bool:
    """Tell glTF, which always has an asset, from other JSON."""
    return data[:64].tobytes().lstrip()[:1] == b"{" and b'"asset"' in data.tobytes()


def _of_document(document: Document, name: str, size: int, beside: Resolve | None) -> PageFile:
    """The document itself; a flip-book, whose pages three.js does not turn, as a cache."""
    if (pages := flipbook_reader.read_pages(document)) is not None:
        return _of_cache(pages, name, size)
    return PageFile(document, PurePath(name).name, size, resolve=beside)


def _of_cache(cache: VertexCache, name: str, size: int) -> PageFile:
    return replace(_converted(convert_cache(cache, PurePath(name).stem), name, size), cache=cache)


def _converted(source: PageSource, name: str, size: int) -> PageFile:
    return PageFile(source.document, PurePath(name).name, size, tuple(source.notes))
