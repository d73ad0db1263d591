"""Files without a name are told by their bytes: all that we write, and some of others."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from anim.caches.registry import CACHE_FORMATS, SIGNATURE_BYTES, sniff_format
from anim.caches.transforms.resample import at_time
from anim.errors import FormatError
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
