"""Files opened for `inspect` and `check`, also invalid ones as far as they can be read."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from copy import copy
from itertools import islice
from pathlib import Path

from anim.check.checked_file import CheckedFile
from anim.errors import AnimError, FormatError
from anim.files import resolver
from anim.gltf.document import Bytes, Document, json_array
from anim.gltf.io import container, uri
from anim.gltf.io.buffers import Resolve
from anim.gltf.io.lenient import BrokenFile, read_broken, unread_buffers
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.measure.inspect.contents import read_contents
from anim.measure.inspect.inspect import inspect
from anim.measure.inspect.report import Facts
from anim.operations.selection import Selection
from cli.io import documents
from cli.text import Reporter

MAX_COMPARED_NAMES = 1000  # of a folder: each of many missing files is compared with all


@contextmanager
def open_checked(
    path: str, selection: Selection | None = None, *, tracks: bool = False
) -> Iterator[tuple[Source, CheckedFile]]:
    """Open a file and inspect it. selection: its clips. tracks: report every track too.

    Raises an AnimError if nothing of it can be read.
    """
    opener = _Opener()
    with documents.source(path, Reporter(quiet=True), opener.open) as source:
        document = source.document
        chosen = selection.chosen_clips(reader.names(document)) if selection and selection.clips else None
        contents = read_contents(document, file_bytes=source.size, broken=opener.broken)
        facts = inspect(contents, chosen=chosen, tracks=tracks)
        yield source, CheckedFile(contents, facts, tuple(_missing_images(document, source.folder)))


def _missing_images(document: Document, folder: Path | None) -> Iterator[tuple[str, str, str]]:
    """Yield label, JSON pointer and problem of every image that is not found from the input's folder."""
    for i, about in enumerate(json_array(document.json, "images")):
        address = about.get("uri")
        if folder is None or address is None or uri.is_data(address):
            continue
        try:
            resolver.locate(folder, uri.relative_path(address))
        except FormatError as error:
            yield f"image {i}", f"/images/{i}/uri", error.problem


def fault_of(path: str, error: AnimError) -> AnimError:
    """Return the error of an unreadable file, without the file's name; of one that isn't there the name is wrong."""
    name = documents.called(path)
    fault = copy(error)
    fault.where = fault.where.removeprefix(name).removeprefix(": ")
    return advise_name(path, fault)


def advise_name(path: str, error: AnimError) -> AnimError:
    """Return an error of a file, with advice on its name if there is no file."""
    if path not in ("", documents.PIPE) and not os.path.lexists(path):
        error.help = _name_advice(path)
    return error


def _name_advice(path: str) -> str:
    """Advice on a name of no file: a similar one in its folder, if there is one."""
    folder, name = os.path.split(path)
    if not os.path.isdir(folder or "."):
        return f"there is no folder '{folder}'"
    with suppress(OSError):  # no permission
        found = (each for each in sorted(os.listdir(folder or ".")) if each.lower().endswith(container.SUFFIXES))
        stems = {Path(each).stem: each for each in islice(found, MAX_COMPARED_NAMES)}  # all have about the same ending
        if near := difflib.get_close_matches(Path(name).stem, stems, n=1):
            return f"did you mean '{stems[near[0]]}'?"
    return "correct its name"


def facts_of_unreadable(fault: AnimError) -> Facts:
    """Return the report of a file that can't be read at all."""
    return Facts(
        generator="",
        extensions_used=(),
        nodes=0,
        meshes=0,
        vertices=None,
        animation_data_bytes=0,
        animation_stored_bytes=0,
        animation_json_bytes=0,
        clips=(),
        skins=(),
        faults=(fault,),
    )


class _Opener:
    """Opens a document, or the readable parts of an invalid one. broken: its errors."""

    def __init__(self) -> None:
        self.broken: BrokenFile | None = None

    def open(self, data: Bytes, resolve: Resolve | None) -> Document:
        """Return the document in `data`; of an invalid one the readable parts."""
        self.broken = None
        try:
            document = container.read(data, resolve)
            reader.skeleton(document)
        except AnimError as refusal:
            self.broken = read_broken(data, resolve, refusal)
            return self.broken.document
        if faults := unread_buffers(document):
            self.broken = BrokenFile(document, faults, frozenset(), frozenset())
        return document
