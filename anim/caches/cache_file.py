"""Write a vertex cache to a path, in the format of its file extension."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import fields
from pathlib import Path

from anim.caches.options import WriteOptions, WriteResult
from anim.caches.registry import CACHE_FORMATS, writer_for
from anim.caches.storage import suffix
from anim.errors import RangeError, not_written
from anim.files import resolver
from anim.files.atomic import AtomicOutputs
from anim.gltf.io.unused_buffers import replace_text
from anim.model import VertexCache

DEFAULTS = WriteOptions()


def save(cache: VertexCache, path: str, options: WriteOptions = DEFAULTS) -> WriteResult:
    """Write a cache and its companion files atomically.

    Raises UnsupportedError for an unknown file extension, RangeError for options that the format does not support,
    OutputError if the files cannot be written.
    """
    ending = suffix(path)
    write = writer_for(ending)
    takes = CACHE_FORMATS[ending].takes
    for each in fields(options):
        if each.name not in takes and getattr(options, each.name) != getattr(DEFAULTS, each.name):
            raise RangeError(f"{each.name} does not apply to {ending}")
    place = resolver.resolve_links(Path(path))
    staged = AtomicOutputs(place.parent, place.name)
    try:
        written = write(cache, staged, options)
        with replace_text(place) if ending == ".gltf" else nullcontext():
            staged.commit()
    except OSError as error:
        raise not_written(path, error) from None
    finally:
        staged.clear()
    return written
