"""Asset: an immutable glTF file in memory, with views of its contents; its methods return copies."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path, PurePath
from typing import BinaryIO, TypeAlias

import numpy as np

from anim.arguments import check_binary_file, check_function, file_path, glob_list
from anim.arrays import Bytes
from anim.clip_list import Clips
from anim.errors import AnimError, FormatError, RangeError, ShapeError, check_type
from anim.files import resolver
from anim.files.resolver import refuse_without_folder
from anim.files.stream import write_stream
from anim.gltf.document import Document, copy_json, count_objects, json_array
from anim.gltf.io import container, json_text
from anim.gltf.io.source import Source, glb_chunks, open_bytes, open_file, write_file
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip, Scene, Skeleton
from anim.operations.selection import match_names

PathName: TypeAlias = str | os.PathLike[str]
RawBytes: TypeAlias = bytes | bytearray | memoryview | Bytes
RAW_BYTES = (bytes, bytearray, memoryview, np.ndarray)


@dataclass(frozen=True, eq=False)
class Asset:
    """A glTF file: its document, and views of its contents, read on first use.

    document: JSON and buffers. source: the input it was read from, or None.
    The dicts and lists of `document.json` may be edited; buffers may be appended, with a data URI. Functions, methods
    and views check the JSON again, as `load` does; a view stays as it was when first used.
    """

    document: Document
    source: Source | None = None

    @cached_property
    def clips(self) -> Clips:
        """The animations, by name or index. Raises FormatError with the position of the first error."""
        return Clips(reader.clips(self._checked()))

    @cached_property
    def skeleton(self) -> Skeleton:
        """All nodes in their rest pose, with the indices of the file."""
        return reader.skeleton(self._checked())

    @cached_property
    def scene(self) -> Scene:
        """The skeleton with all meshes. Raises UnsupportedError if vertices can't be read."""
        return reader.scene(self._checked())

    @cached_property
    def _viewed_json(self) -> bytes:
        """The JSON at the first use of a view."""
        return json_text.dump(self.document.json)

    def _checked(self) -> Document:
        document = container.check_edits(self.document)
        _ = self._viewed_json
        return document

    def reread(self) -> Asset:
        """Return the asset itself, or one with new views if its JSON was edited since a view was used."""
        is_same = "_viewed_json" not in vars(self) or json_text.dump(self.document.json) == self._viewed_json
        return self if is_same else replace(self)

    @property
    def name(self) -> str:
        """Name for messages: the path it was loaded from."""
        return self.source.name if self.source is not None else "asset"

    def map_clips(self, change: Callable[[Clip], Clip], *, clips: str | Sequence[str] | None = None) -> Asset:
        """Return the asset with `change` applied to clips; everything else is unchanged.

        change: Clip → Clip, such as `lambda clip: anim.ops.resample(clip, fps=30)`. A new name is written too.
        clips: globs for names, "run*" or several; all by default. Raises NotFoundError for a glob without match,
        RangeError for an empty list.
        """
        check_function(change, "change", "a function from Clip to Clip")
        globs = glob_list(clips, "clips")
        new, views = {}, self.reread()
        for i in match_names(globs, views.clips.names, "clip"):
            old = views.clips[i]
            try:
                changed = change(old)
                if not isinstance(changed, Clip):
                    raise ShapeError(f"change returns {type(changed).__name__} (expected a Clip)")
            except AnimError as error:
                raise error.at(reader.clip_label(old.name, i)) from None
            if changed is not old:
                new[i] = changed
        if not new:
            return copy_asset(self)
        document = writer.replace_clips(container.check_edits(self.document), new)
        return replace(self, document=_rename(document, {i: clip.name for i, clip in new.items()}))

    def add_clips(self, clips: Iterable[Clip]) -> Asset:
        """Return the asset with clips appended to its animations; those without tracks are omitted.

        Raises RangeError for a track of a node that the asset doesn't have.
        asset.add_clips([Clip("rise", (Track(0, "translation", "LINEAR", [0, 1], [[0, 0, 0], [0, 1, 0]]),))])
        """
        from anim.gltf.authoring import add_clips

        check_type(clips, Iterable, "clips")
        new, count = list(clips), len(json_array(self.document.json, "nodes"))
        for i, clip in enumerate(new):
            check_type(clip, Clip, f"clips[{i}]")
            if strange := [track.node for track in clip.tracks if track.node is not None and track.node >= count]:
                raise RangeError(
                    f"clips[{i}] has a track of node {strange[0]} (the asset has {count} nodes, from 0 on)"
                )
        document = container.check_edits(self.document)
        longer = add_clips(document, new)
        return copy_asset(self) if longer is document else replace(self, document=longer)

    def save(self, path: PathName | BinaryIO) -> None:
        """Write the asset, as `anim.save` does."""
        save(self, path)

    def _repr_html_(self) -> str:
        """Return the page that plays the asset, for notebooks."""
        from anim.show.page import notebook
        from anim.show.page.page import page

        return notebook.frame(lambda: page(notebook.document_file(self._checked(), self.source)), repr(self))

    def __repr__(self) -> str:
        counts = count_objects(self.document.json, ("animations", "nodes", "meshes"))
        is_changed = self.source is not None and self.document is not self.source.document
        return f"Asset({self.name!r}, {counts}{', changed' if is_changed else ''})"


AssetLike: TypeAlias = Asset | Document | PathName


def copy_asset(asset: Asset) -> Asset:
    """Return an equal asset with JSON of its own; an unchanged one still has the bytes it was read from."""
    document, source = replace(asset.document, json=copy_json(asset.document.json)), asset.source
    if source is not None and source.document is asset.document:
        source = source._replace(document=document)
    return Asset(document, source)


def load(file: PathName | RawBytes | BinaryIO) -> Asset:
    """Return the glTF asset in a .glb or .gltf file.

    file: a path, the bytes of a file, or a binary file open for reading; it is read completely, and later changes of it
    or of writable bytes don't change the asset. External buffers of a .gltf are read only from
    its folder and below, and only for a path, since bytes have no folder.
    Raises FormatError for unreadable or invalid glTF, UnsupportedError for an unsupported required extension.
    load("walk.glb").clips["walk"] → Clip('walk', …)
    """
    if isinstance(file, Document | Asset):
        raise ShapeError(f"file is {type(file).__name__} (expected a path or bytes)", help="it is loaded already")
    if isinstance(file, str | os.PathLike):
        path = file_path(file, "file")
        return _read_asset(path, lambda: open_file(path))
    name = "bytes" if isinstance(file, RAW_BYTES) else str(getattr(file, "name", "file"))
    data = _bytes_of(file, name)
    return _read_asset(name, lambda: open_bytes(data, name, resolve=refuse_without_folder))


def save(asset: Asset | Document, path: PathName | BinaryIO) -> None:
    """Write an asset as GLB or, for a path with the extension .gltf, as text with a companion .bin.

    path: a name with the extension .glb, .gltf, .vrm or .vrma, or a binary file open for writing, for a GLB.
    Files are replaced atomically; the input may be the output. An unchanged asset keeps its bytes; changes
    in the dicts and lists of its JSON are written. In another folder external images are copied next to the output.
    Raises OutputError if a file can't be written, FormatError if the JSON was made invalid, RangeError for another
    extension, ShapeError for a file not open for binary writing.
    """
    asset = Asset(asset) if isinstance(asset, Document) else asset
    if not isinstance(asset, Asset):
        raise ShapeError(f"asset is {type(asset).__name__} (expected an Asset)", help="save(result.asset, path)")
    own = _own_bytes(asset)
    document = container.check_edits(asset.document) if own is None else asset.document
    if not isinstance(path, str | os.PathLike):
        check_binary_file(path, "path", "write")
        name = str(getattr(path, "name", "file"))
        write_stream(path, (piece.data for piece in glb_chunks(document, own)), name)
        return
    name = file_path(path)
    _check_ending(name)
    write_file(document, name, asset.source, unchanged=own)


def as_asset(value: AssetLike) -> Asset:
    """Return an asset with the JSON as it is now, or the asset of a document or a path."""
    if isinstance(value, Asset):
        return value.reread()
    return Asset(value) if isinstance(value, Document) else load(value)


def _own_bytes(asset: Asset) -> Bytes | None:
    """Bytes that the asset was read from, None if it was changed since then."""
    own = asset.source.bytes_of(asset.document) if asset.source is not None else None
    return None if own is None or asset.source is None or asset.source.is_edited() else own


def _read_asset(name: str, read: Callable[[], Source]) -> Asset:
    try:
        source = read()
    except AnimError as error:
        raise error.at(name, ": ") from None
    return Asset(source.document, source)


def _bytes_of(file: RawBytes | BinaryIO, name: str) -> Bytes:
    """Bytes that nobody else can change: a copy unless they are immutable."""
    if not isinstance(file, RAW_BYTES):
        check_binary_file(file, "file", "read")
    data: object = file if isinstance(file, RAW_BYTES) else _read_stream(file, name)
    if isinstance(data, np.ndarray):
        return data.copy()
    if not isinstance(data, bytes | bytearray | memoryview):
        raise ShapeError(f"file gives {type(data).__name__} (expected bytes)")
    return np.frombuffer(data if isinstance(data, bytes) else bytes(data), np.uint8)


def _read_stream(file: BinaryIO, name: str) -> object:
    try:
        return file.read()
    except OSError as error:
        raise FormatError(f"{name}: can't be read ({(error.strerror or str(error)).lower()})") from None


def _check_ending(path: str) -> None:
    ending = PurePath(path).suffix.lower()
    target = resolver.resolve_links(Path(path))
    if ending in container.SUFFIXES or (target.exists() and not target.is_file() and not target.is_dir()):  # /dev/null
        return
    near = difflib.get_close_matches(ending, container.SUFFIXES, n=1)
    expected = ", ".join(container.SUFFIXES)
    raise RangeError(
        f"{path}: '{ending}' is no ending of a glTF file (expected {expected})",
        help=f"did you mean {PurePath(path).with_suffix(near[0])}?" if near else "bakes and caches have their own save",
    )


def _rename(document: Document, names: dict[int, str]) -> Document:
    animations = list(json_array(document.json, "animations"))
    for i, name in names.items():
        if animations[i].get("name", "") != name:
            animations[i] = {**animations[i], "name": name}
    return replace(document, json={**document.json, "animations": animations})
