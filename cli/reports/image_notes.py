"""Notes on external images of a document written to another folder."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from anim.errors import FormatError
from anim.files import resolver
from anim.gltf.document import Document, json_array
from anim.gltf.io import uri
from anim.gltf.io.images import external_uri, find_image, is_image, locate_image
from anim.gltf.io.source import Source
from anim.units import plural
from cli.io import command_files, documents
from cli.streams import step_streams
from cli.text import Reporter

MAX_LISTED_NAMES = 3  # names in a note


def report(document: Document, source: Source, output: str, reporter: Reporter) -> None:
    """Report the images of a written document that were copied to the output's folder, and the missing ones.

    Those that a pipe leaves behind are a warning.
    """
    warn_of_pipe(document, source.folder, output, reporter)
    if output != documents.PIPE and not source.is_in_folder(output):
        for note in notes(document, source.folder, copied_names(output)):
            reporter.info(note)


def copied_names(output: str) -> list[str]:
    """Return the images that were copied since the last call, as URIs from the output's folder."""
    return relative_names(output, command_files.take_copies())


def relative_names(output: str, paths: Iterable[Path]) -> list[str]:
    """Return paths as URIs from the output's folder."""
    folder = resolver.resolve_links(Path(output)).parent
    return [uri.from_path(os.path.relpath(each, folder).replace(os.sep, "/")) for each in paths]


def warn_of_pipe(document: Document, folder: Path | None, output: str, reporter: Reporter) -> None:
    """Warn of images that stay beside the input of a pipe; a step of a recipe has them beside its output later."""
    if output != documents.PIPE or step_streams() is not None:
        return
    images = json_array(document.json, "images")
    if left := [image["uri"] for image in images if find_image(folder, image) is not None]:
        reporter.warn(
            f"{plural(len(left), 'image')} left behind ({_listed(left)}): a pipe carries one GLB; "
            "convert IN - --embed, as the first command, takes images in"
        )


def notes(document: Document, folder: Path | None, copied: Sequence[str] = ()) -> Iterator[str]:
    """Yield notes on the external images of a document written to another folder.

    copied: names of those that were copied; others are there already.
    """
    outside = [image for image in json_array(document.json, "images") if external_uri(image)]
    files = [locate_image(folder, image) for image in outside]
    pairs = list(zip(outside, files, strict=True))
    lost = [image["uri"] for image, file in pairs if file is None]
    found = [image["uri"] for image, file in pairs if file is not None and is_image(file, image)]
    known = {*lost, *found}
    others = [image["uri"] for image in outside if image["uri"] not in known]
    if copied:
        yield f"note: {plural(len(copied), 'image')} copied beside the output ({_listed(copied)})"
    if others:
        words = "is" if len(others) == 1 else "are"
        yield (
            f"note: {plural(len(others), 'image')} {words} left out, since name or first bytes of the file are "
            f"those of no image ({_listed(others)})"
        )
    away = [address for address in lost if folder is not None and _is_outside(address)]
    far = {*away}
    if away:
        words = "refers" if len(away) == 1 else "refer"
        yield (
            f"note: {plural(len(away), 'image')} {words} out of the file's folder, never copied, and missing "
            f"unless the same address is right for the output ({_listed(away)})"
        )
    if lost := [address for address in lost if address not in far]:
        yield f"note: {plural(len(lost), 'image')} missing, since no such file can be read ({_listed(lost)})"


def _is_outside(address: str) -> bool:
    """Return whether an address is a URL, absolute, or above the file's folder: it is never read."""
    try:
        uri.relative_path(address)
    except FormatError:
        return True
    return False


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:MAX_LISTED_NAMES]) + (", …" if len(names) > MAX_LISTED_NAMES else "")
