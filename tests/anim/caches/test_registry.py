"""Files without a name are told by their bytes: all that we write, and some of others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from anim.arrays import as_floats
from anim.caches.options import ReadOptions
from anim.caches.registry import CACHE_FORMATS, SIGNATURE_BYTES, CacheFormat, reader_for, sniff_format
from anim.caches.storage import Inputs, Memory
from anim.caches.transforms.resample import at_time
from anim.errors import FormatError, RangeError
from anim.model import FrameChunk, VertexCache
from tests.anim.caches.making import FACES, cache, written


@pytest.mark.parametrize("ending", CACHE_FORMATS)
@pytest.mark.parametrize("normals", [True, False])
def test_all_that_we_write(ending: str, normals: bool) -> None:
    data = written(at_time(cache(normals=normals), 0), f"a{ending}")[0].files[f"a{ending}"]
    assert sniff_format(data[:SIGNATURE_BYTES], len(data)) == ending


@pytest.mark.parametrize(("kind", "ending"), [("ply", ".ply"), ("stl", ".stl"), ("stl_ascii", ".stl"), ("obj", ".obj")])
def test_what_trimesh_writes(kind: str, ending: str) -> None:
    mesh = trimesh.Trimesh(np.random.default_rng(1).normal(size=(9, 3)), FACES, process=False)
    data = mesh.export(file_type=kind)
    data = data.encode() if isinstance(data, str) else data
    assert sniff_format(data[:SIGNATURE_BYTES], len(data)) == ending


def test_a_long_obj_whose_last_line_is_cut() -> None:
    data = b"# a comment\n\nmtllib a.mtl\no body\n" + b"v 0.25 0.5 0.75\n" * 200
    assert sniff_format(data[:SIGNATURE_BYTES], len(data)) == ".obj"


@pytest.mark.parametrize(
    "data", [b"", b"hello there\n", b"v 0 0 0\nhello\n", b"solid ground\n", b"\0" * 100, b'{"asset":{}}', b"\n\n"]
)
def test_what_no_cache_begins_with(data: bytes) -> None:
    with pytest.raises(FormatError, match=r"as no cache format does|is empty"):
        sniff_format(data, len(data))


def _one_chunk() -> Iterator[FrameChunk]:
    yield FrameChunk(0, np.zeros((1, 3, 3), np.float32))
    as_floats(np.zeros(3), "F V 3", name="positions")


def _late_times(inputs: Inputs, reading: ReadOptions) -> VertexCache:
    return VertexCache(np.array([1.0, 0.0]), 3, FACES[:1], _one_chunk)


def _bad_chunk(inputs: Inputs, reading: ReadOptions) -> VertexCache:
    return VertexCache(np.array([0.0, 1.0]), 3, FACES[:1], _one_chunk)


def test_array_errors_of_contents_are_format_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    _use(monkeypatch, replace(CACHE_FORMATS[".mdd"], read=_late_times))
    with pytest.raises(FormatError, match="times not increasing at key 1"):
        reader_for(".mdd")(Memory("a.mdd", {}), ReadOptions())
    with pytest.raises(RangeError):  # with the caller's fps it may be the caller's error
        reader_for(".mdd")(Memory("a.mdd", {}), ReadOptions(1e6))
    _use(monkeypatch, replace(CACHE_FORMATS[".mdd"], read=_bad_chunk))
    read = reader_for(".mdd")(Memory("a.mdd", {}), ReadOptions())
    for _ in range(2):
        with pytest.raises(FormatError, match="positions has shape"):
            list(read.chunks())


def _use(monkeypatch: pytest.MonkeyPatch, entry: CacheFormat) -> None:
    monkeypatch.setitem(CACHE_FORMATS, ".mdd", entry)
