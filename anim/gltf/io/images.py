"""External images of a glTF: copied to the output's folder or embedded in the file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath

from anim.errors import FormatError, OutputError
from anim.files import atomic, before_commit, resolver
from anim.gltf.document import Bytes, Document, Json, json_array
from anim.gltf.io import uri


def copy_images(document: Document, folder: Path, target: Path) -> tuple[Document, dict[Path, Bytes]]:
    """Return a document moved from `folder` to `target`, and the images to copy, by path.

    They keep their relative paths, and the URIs are unchanged. If another file has the name, the copy is named after
    its content (`skin-1a2b3c4d.png`). References to images that cannot be read are unchanged.
    """
    copies: dict[Path, Bytes] = {}
    images: list[Json] = []
    for image in json_array(document.json, "images"):
        address, data = external_uri(image), read_image(folder, image)
        if data is not None and address:
            name = _free(target, uri.relative_path(address), data, copies)
            copies[target / name] = data
            image = image if name == uri.relative_path(address) else {**image, "uri": uri.from_path(name)}
        images.append(image)
    changed = replace(document, json={**document.json, "images": images}) if copies else document
    return changed, copies


def write_copies(copies: Mapping[Path, Bytes], within: Path | None = None) -> None:
    """Write images to free names; an existing file there has the same bytes. Raises OutputError.

    within: a folder that none of them may leave by a link.
    """
    if copies:
        before_commit.run_job()
    if within is not None:
        for path in copies:
            _check_place(path, within)
    for path, data in copies.items():
        with atomic.name_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                with atomic.temporary_files() as made:
                    atomic.move_to_free(atomic.write_temporary(path, [data], made), path)


def _check_place(path: Path, folder: Path) -> None:
    with atomic.name_errors(path):
        if not path.exists() and not path.resolve().is_relative_to(folder.resolve()):
            raise OutputError(f"{path}: leads out of '{folder}' by a link")


def embed(document: Document, folder: Path | None) -> Document:
    """Return the document with its readable external images as data URIs."""
    images = [
        image if (data := read_image(folder, image)) is None else {**image, "uri": _data_uri(data)}
        for image in json_array(document.json, "images")
    ]
    return replace(document, json={**document.json, "images": images}) if images else document


def external_uri(image: Json) -> str:
    """Return the URI of an external image, else ""."""
    address = str(image.get("uri", ""))
    return "" if uri.is_data(address) else address


def read_image(folder: Path | None, image: Json) -> Bytes | None:
    """Return the bytes of an external image; None for others, or if the file cannot be read."""
    address = external_uri(image)
    if not address or folder is None:
        return None
    try:
        return resolver.open_relative(folder, uri.relative_path(address))
    except FormatError:
        return None


def _free(target: Path, name: str, data: Bytes, copies: Mapping[Path, Bytes]) -> str:
    """The free name for a copy in the folder."""
    import hashlib

    digest = hashlib.sha256(data.data).hexdigest()
    path = PurePosixPath(name)
    for each in (name, *(str(path.with_name(f"{path.stem}-{digest[:n]}{path.suffix}")) for n in (8, 16, 64))):
        if target / each in copies or not os.path.lexists(target / each) or atomic.has_bytes(target / each, [data]):
            return each
    raise OutputError(f"{target / name}: is there already, with other content")


def _data_uri(data: Bytes) -> str:
    return uri.encode_data(data.tobytes(), media_type(data))


def media_type(data: Bytes) -> str:
    """Return the media type of an image by its first bytes; application/octet-stream if unknown."""
    head = data[:12].tobytes()
    if head.startswith(b"\x89PNG"):
        return "image/png"
    if head.startswith(b"\xff\xd8"):
        return "image/jpeg"
    if head.startswith(b"RIFF") and head[8:12] == b"WEBP":
        return "image/webp"
    if head[4:12] == b"ftypavif":
        return "image/avif"
    return "image/ktx2" if head.startswith(b"\xabKTX 20") else "application/octet-stream"
