"""Read documents with their external buffers from files, and write them atomically."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, TypeAlias

from anim.errors import FormatError, OutputError, not_written
from anim.files import resolver
from anim.gltf.document import Buffer, Bytes, Document, json_array
from anim.gltf.io import container, json_text, uri
from anim.gltf.io.buffers import Resolve

MAX_NAME_ATTEMPTS = 20  # attempts to name images, while others write into the same folder
MAX_OPEN_ATTEMPTS = 20  # attempts to open a .gltf with its buffers, while others replace it

Opener: TypeAlias = Callable[[Bytes, Resolve | None], Document]
Note: TypeAlias = Callable[[str], object]


class Source(NamedTuple):
    """An input: document, label for messages, size with its .bin files, real folder, own bytes.

    folder: None for input from bytes, which has no other files.
    """

    document: Document
    name: str
    size: int
    folder: Path | None
    data: Bytes

    def is_in_folder(self, output: str) -> bool:
        """Return True if `output` is in the same folder, so that relative URIs remain valid.

        Raises OutputError if its folder can't be looked up, as while it is exchanged with a link.
        """
        if self.folder is None:
            return False
        try:
            return resolver.resolve_links(Path(output)).parent.resolve() == self.folder.resolve()
        except OSError as error:
            raise not_written(output, error) from None

    def bytes_of(self, document: Document) -> Bytes | None:
        """Return the input's bytes if the document is unchanged since it was read, else None."""
        return self.data if document is self.document and not document.expanded else None

    def is_edited(self) -> bool:
        """Return True if a dict or list of the document's JSON was changed in place since it was read."""
        return json_text.dump(container.read(self.data).json) != json_text.dump(self.document.json)

    def is_at(self, path: str) -> bool:
        """Return True if this is the file at `path`."""
        return self.folder is not None and os.path.realpath(self.name) == os.path.realpath(path)


def open_file(path: str, opener: Opener = container.read) -> Source:
    """Return the document at `path`; links are followed, external buffers must be in its folder or below.

    opener: converts bytes to a document. If the file is replaced while its buffers are opened, it is opened again.
    Raises FormatError.
    """
    real = resolver.resolve_links(Path(path))
    for _ in range(MAX_OPEN_ATTEMPTS):
        before = _stamp(real)
        data, buffers = resolver.read_file(real, read=resolver.read_gltf), resolver.CompanionFiles(real.parent)
        document = opener(data, buffers)
        outside = [each for each in document.buffers if each.uri is not None and not uri.is_data(each.uri)]
        for buffer in outside:
            with suppress(FormatError):  # raised again when the bytes are used
                _ = buffer.data
        if not outside or _stamp(real) == before:
            break
    return Source(document, path, len(data) + external_size(document), real.parent, data)


def open_bytes(
    data: Bytes,
    name: str,
    opener: Opener = container.read,
    *,
    resolve: Resolve = resolver.refuse_relative,
) -> Source:
    """Return the document in `data`, without a folder. name: its label in messages. Raises FormatError.

    resolve: called for external buffers; by default raises the error for an input from a pipe.
    """
    document = opener(data, resolve)
    return Source(document, name, len(data) + external_size(document), None, data)


def write_file(
    document: Document,
    path: str,
    source: Source | None,
    *,
    unchanged: Bytes | None = None,
    spared: Sequence[Path] = (),
    within: Path | None = None,
    dry_run: bool = False,
    note: Note = lambda words: None,
) -> int:
    """Write a document and return its size: a GLB or, for a `path` ending in .gltf, text and .bin files.

    The size in bytes includes files that remain unchanged. source: the input of the document: external buffers and
    images with a URI that is also valid in the output's folder keep it, and none of the input's files is ever removed.
    In another folder images are copied to the output's folder, and no file is overwritten. Files are written
    atomically, and only if their bytes differ from the existing ones; otherwise only the modification time of the file
    at `path` is updated. unchanged: the input's bytes of the same content (`Source.bytes_of`), written instead of new
    ones where possible. spared: more files that are never removed. within: a folder that no copy of an image may leave
    by a link.
    note: called with a line about buffers of a replaced .gltf that are not removed. Raises OutputError.
    """
    from anim.files import atomic, guard
    from anim.files.special_files import is_special
    from anim.gltf.io import gltf_files

    folder = None if source is None or source.is_in_folder(path) or is_special(Path(path)) else source.folder
    moved = document if folder is None else copy_external_images(document, folder, path, within=within, dry_run=dry_run)
    unchanged = unchanged if moved is document else None  # copies may have got other names
    document = moved
    guard.plan(Path(path), in_place=True)
    if not path.lower().endswith(".gltf"):
        content = glb_chunks(document, unchanged)
        if not dry_run:
            atomic.write_file(Path(path), content, in_place=True)
        return sum(len(piece) for piece in content)
    same_folder = source is not None and source.is_in_folder(path)
    needed = [] if source is None or source.is_at(path) else list(external_files(source))
    text = None if unchanged is None or unchanged[:4].tobytes() == container.MAGIC else unchanged
    size = gltf_files.write(
        document, Path(path), same_folder=same_folder, spared=[*spared, *needed], text=text, dry_run=dry_run, note=note
    )
    return size + (sum(map(_size_outside, document.buffers)) if same_folder else 0)


def copy_external_images(
    document: Document, folder: Path, path: str, *, within: Path | None = None, dry_run: bool = False
) -> Document:
    """Copy the images of a document in `folder` to the folder of an output; return the document with their names.

    The document itself if it has none. within: as of `write_file`. Raises OutputError.
    """
    from anim.files import guard
    from anim.gltf.io import images

    target = resolver.resolve_links(Path(path)).parent
    for _ in range(MAX_NAME_ATTEMPTS):
        moved, copies = images.copy_images(document, folder, target)
        guard.plan(Path(path), in_place=True)  # before an image is copied
        guard.plan_new(copies)
        if dry_run or images.write_copies(copies, within):
            return moved
    raise OutputError(f"{path}: names of its images are taken by other files again and again")


def glb_chunks(document: Document, unchanged: Bytes | None = None) -> list[Bytes]:
    """Return the chunks of a GLB; `unchanged` itself if it is a GLB with all its buffers."""
    content = container.glb(document)
    return (
        [unchanged]
        if unchanged is not None and container.is_glb(unchanged) and not external_size(document)
        else content
    )


def external_size(document: Document) -> int:
    """Return the total bytes of the external buffers."""
    return sum(map(_size_outside, document.buffers))


def _stamp(path: Path) -> tuple[int, ...]:
    """File status that changes if a file is replaced."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return ()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def buffer_files(source: Source) -> list[Path]:
    """Return the paths of an input's external buffers."""
    return list(_files(source, "buffers"))


def external_files(source: Source) -> Iterator[Path]:
    """Yield the paths of an input's buffers and images."""
    yield from _files(source, "buffers")
    yield from _files(source, "images")


def _files(source: Source, key: str) -> Iterator[Path]:
    for about in json_array(source.document.json, key):
        address = about.get("uri")
        if source.folder is not None and address is not None and not uri.is_data(address):
            with suppress(FormatError):
                yield source.folder / uri.relative_path(address)


def _size_outside(buffer: Buffer) -> int:
    """Bytes of an external buffer, 0 for others."""
    is_file = buffer.uri is not None and not uri.is_data(buffer.uri) and not buffer.replaced
    return buffer.byte_length if is_file else 0
