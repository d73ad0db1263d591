"""Which rest mesh a PC2 or MDD takes: its own, marked as such; and what is said of others."""

from __future__ import annotations

import numpy as np
import pytest

from anim.caches.options import ReadOptions, WriteOptions
from anim.caches.storage import Memory
from anim.caches.transforms.resample import resample_frames
from anim.caches.transforms.up_axis import to_up_axis
from anim.model import VertexCache
from anim.model.vertex_cache import from_arrays
from tests.anim.caches.making import FACES, cache, opened, written

LARGER = from_arrays(np.arange(7) / 30, np.random.default_rng(8).normal(size=(7, 12, 3)), FACES[:1])


def read(files: Memory, main: str = "a.pc2") -> tuple[VertexCache, list[str]]:
    """The cache that a reader finds, and what it says."""
    files.main = main
    notes: list[str] = []
    return opened(files, ReadOptions(note=notes.append)), notes


def test_caches_of_one_stem_keep_their_own() -> None:
    files = written(to_up_axis(cache(), "z"), "a.pc2")[0]
    files.files |= written(LARGER, "a.mdd")[0].files
    files.files |= written(cache(), "a.png")[0].files | written(LARGER, "a.exr")[0].files
    for name, up, faces in (("a.pc2", "z", 4), ("a.mdd", "y", 1), ("a.png", "y", 4), ("a.exr", "y", 1)):
        found, notes = read(files, name)
        assert (found.up, len(found.faces), notes) == (up, faces, [])


@pytest.mark.parametrize(
    ("later", "words"),
    [
        (to_up_axis(cache(), "z"), "'a.pc2-rest.ply' is the rest mesh of another cache: left out"),
        (resample_frames(cache(), np.arange(4) / 15), "'a.pc2-rest.ply' is the rest mesh of another cache: left out"),
        (LARGER, "'a.pc2-rest.ply' has 9 vertices, the cache 12: left out"),
    ],
)
def test_what_an_earlier_cache_left_is_not_taken(later: VertexCache, words: str) -> None:
    files = written(cache(), "a.pc2")[0]
    files.files |= written(later, "a.pc2", WriteOptions(rest_mesh=""))[0].files
    found, notes = read(files)
    assert (len(found.faces), found.rest, notes) == (0, None, [words])


def test_a_newer_obj_goes_before_an_older_ply() -> None:
    files = written(cache(), "a.mdd")[0]
    files.files |= written(to_up_axis(cache(), "z"), "a.mdd", WriteOptions(rest_mesh=".obj"))[0].files
    found, notes = read(files, "a.mdd")
    assert (found.up, len(found.faces)) == ("z", 4)
    assert notes == ["'a.mdd-rest.ply' is the rest mesh of another cache: left out"]


@pytest.mark.parametrize("name", ["a-rest.ply", "a-rest.obj", "a.ply", "a.obj"])
def test_meshes_that_only_their_name_speaks_for_are_said(name: str) -> None:
    files = written(to_up_axis(cache(), "z"), "a.pc2", WriteOptions(rest_mesh=name[-4:]))[0]
    data = files.files.pop(f"a.pc2-rest{name[-4:]}")
    at = data.index(b" of=")
    files.files[name] = data[:at] + data[at + len(" of=01234567") :]  # as earlier versions wrote it
    found, notes = read(files)
    assert (found.up, len(found.faces), found.times[1]) == ("z", 4, pytest.approx(1 / 30))
    assert notes == [f"faces and axes are those of '{name}', by its name and number of vertices"]
