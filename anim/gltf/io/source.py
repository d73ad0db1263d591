"""Documents and the files that hold them: opened with the buffers beside them, written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from anim.errors import FormatError
from anim.files import atomic, links, resolver
from anim.gltf.document import Buffer, Bytes, Document, json_array
from anim.gltf.io import container, gltf_files, images, uri

MAX_TRIES = 20  # of opening a .gltf with its buffers, while others replace it

Opener: TypeAlias = Callable[[Bytes, container.Resolve | None], Document]


@dataclass(frozen=True, slots=True)
class Source:
    """An input: its document, what messages call it, its size with its .bin files, its real folder, its own bytes.

    folder: None where the input came as bytes, so that nothing lies beside it.
    """

    document: Document
    name: str
    size: int
    folder: Path | None
    data: Bytes

    def is_beside(self, output: str) -> bool:
        """Return whether `output` lies in the same folder, so that relative URIs stay right."""
        return self.folder is not None and links.resolve_links(Path(output)).parent.resolve() == self.folder.resolve()

    def bytes_of(self, document: Document) -> Bytes | None:
        """Return the bytes of the input where they are still those of a document: nothing of it was changed."""
        return self.data if document is self.document and not document.expanded else None

    def is_at(self, path: str) -> bool:
        """Return whether this is the file at `path`."""
        return self.folder is not None and os.path.realpath(self.name) == os.path.realpath(path)


def open_file(path: str, opener: Opener = container.read) -> Source:
    """Return the document at `path`; a link is followed, and buffers beside it must lie in or below its folder.

    opener: makes a document of bytes. If the file is replaced while its buffers are opened, it is opened again.
    Raises FormatError.
    """
    real = links.resolve_links(Path(path))
    for _ in range(MAX_TRIES):
        before = _stamp(real)
        data, buffers = resolver.map_file(real), resolver.CompanionFiles(real.parent)
        document = opener(data, buffers.open)
        outside = [each.uri for each in document.buffers if each.uri is not None and not uri.is_data(each.uri)]
        for address in outside:
            with suppress(FormatError):  # raised again where its bytes are asked for
                buffers.open(uri.relative_path(address))
        if not outside or _stamp(real) == before:
            break
    return Source(document, path, len(data) + external_size(document), real.parent, data)


def open_bytes(data: Bytes, name: str, opener: Opener = container.read) -> Source:
    """Return the document in `data`, with nothing beside it. name: what messages call it. Raises FormatError."""
    document = opener(data, resolver.refuse_relative)
    return Source(document, name, len(data) + external_size(document), None, data)


def write_file(
    document: Document,
    path: str,
    source: Source | None,
    *,
    unchanged: Bytes | None = None,
    dry_run: bool = False,
    note: gltf_files.Note = lambda words: None,
) -> int:
    """Write a document and return its size in bytes: a GLB or, where `path` ends in .gltf, text with its .bin beside.

    The size is that of all these files, also of those that stay as they are. source: the input that the document comes
    from: external buffers and images that are still right from the output's folder keep their URI, and none of its
    files is ever removed. In another folder images are copied beside the output, and no file is overwritten. Files
    appear whole or not at all, and only if their bytes differ from what is there; else the time of the file at `path`
    is updated. unchanged: bytes that say the same already (`Source.bytes_of`), written where they do as they are.
    note: is told of files that were buffers of a replaced .gltf and stay. Raises OutputError.
    """
    copies: dict[Path, Bytes] = {}
    if source is not None and source.folder is not None and not source.is_beside(path):
        document, copies = images.copy_images(document, source.folder, links.resolve_links(Path(path)).parent)
        unchanged = None if copies else unchanged  # some may have got other names
    if not dry_run:
        images.write_copies(copies)
    if not path.lower().endswith(".gltf"):
        content = glb_chunks(document, unchanged)
        if not dry_run:
            atomic.write_file(Path(path), content)
        return sum(len(piece) for piece in content)
    same_folder = source is not None and source.is_beside(path)
    spared = [] if source is None or source.is_at(path) else list(_files_beside(source))
    text = None if unchanged is None or unchanged[:4].tobytes() == container.MAGIC else unchanged
    size = gltf_files.write(
        document, Path(path), same_folder=same_folder, spared=spared, text=text, dry_run=dry_run, note=note
    )
    return size + (sum(map(_size_outside, document.buffers)) if same_folder else 0)


def glb_chunks(document: Document, unchanged: Bytes | None = None) -> list[Bytes]:
    """Return the pieces of a GLB; `unchanged` as it is where that is one, with all its buffers."""
    content = container.glb(document)
    return (
        [unchanged]
        if unchanged is not None and container.is_glb(unchanged) and not external_size(document)
        else content
    )


def external_size(document: Document) -> int:
    """Return the bytes of the buffers that are files of their own."""
    return sum(map(_size_outside, document.buffers))


def _stamp(path: Path) -> tuple[int, ...]:
    """What changes when a file is replaced."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return ()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _files_beside(source: Source) -> Iterator[Path]:
    """Yield where the buffers and images of an input lie."""
    for about in (*json_array(source.document.json, "buffers"), *json_array(source.document.json, "images")):
        address = about.get("uri")
        if source.folder is not None and address is not None and not uri.is_data(address):
            with suppress(FormatError):
                yield source.folder / uri.relative_path(address)


def _size_outside(buffer: Buffer) -> int:
    """Bytes of a buffer that is a file of its own, 0 of others."""
    is_file = buffer.uri is not None and not uri.is_data(buffer.uri) and not buffer.replaced
    return buffer.byte_length if is_file else 0
