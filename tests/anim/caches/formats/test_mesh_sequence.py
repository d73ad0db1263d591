"""A mesh a frame: trimesh reads each, vertices in their order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh

from anim.caches.options import ReadOptions
from anim.caches.storage import Memory
from anim.caches.transforms.resample import at_time, resample_frames
from anim.errors import FormatError
from tests.anim.caches.making import FACES, by_trimesh, cache, normals_of, opened, positions_of, written


@pytest.mark.parametrize("ending", [".ply", ".obj"])
@pytest.mark.parametrize("normals", [True, False])
def test_trimesh_reads_every_frame(ending: str, normals: bool) -> None:
    source = cache(normals=normals)
    files, _ = written(source, f"walk{ending}")
    assert sorted(files.files) == [f"walk_{i:05d}{ending}" for i in range(1, 8)]
    whole = source.load_all()
    for f, name in enumerate(sorted(files.files)):
        if ending == ".obj":  # trimesh gives the order of an OBJ up where it has normals
            lines = [line.split()[1:] for line in files.files[name].decode().splitlines() if line.startswith("v ")]
            assert np.array(lines, float) == pytest.approx(whole.positions[f], abs=1e-9)
            continue
        mesh = by_trimesh(files.files[name], ".ply")
        assert (mesh.vertices == whole.positions[f]).all()
        assert mesh.faces.tolist() == FACES.tolist()
        if whole.normals is not None:
            assert mesh.vertex_normals == pytest.approx(whole.normals[f], abs=1e-7)


def test_stl_has_the_corners_of_all_triangles() -> None:
    source = cache()
    files, said = written(source, "walk.stl")
    for f, name in enumerate(sorted(files.files)):
        mesh = by_trimesh(files.files[name], ".stl")
        assert (mesh.triangles == positions_of(source)[f][FACES]).all()
    assert "no order" in said.notes[0]


@pytest.mark.parametrize("ending", [".ply", ".obj"])
def test_back_again(ending: str) -> None:
    source = cache()
    files, _ = written(source, f"walk{ending}")
    for main in (f"walk{ending}", f"walk_00003{ending}"):
        files.main = main
        back = opened(files)
        assert back.times == pytest.approx(source.times, abs=1e-8)
        assert positions_of(back) == pytest.approx(positions_of(source), abs=1e-9)
        assert normals_of(back) == pytest.approx(normals_of(source), abs=1e-7)


@pytest.mark.parametrize("ending", [".ply", ".obj", ".stl"])
def test_what_a_longer_sequence_left_behind_is_no_part_of_a_shorter_one(ending: str) -> None:
    source = cache()
    files, _ = written(source, f"walk{ending}")
    shorter, _ = written(resample_frames(source, source.times[:3]), f"walk{ending}")
    files.files |= shorter.files
    assert len(files.files) == 7
    back = opened(files)
    assert back.times == pytest.approx(source.times[:3], abs=1e-8)
    assert len(positions_of(back)) == 3


@pytest.mark.parametrize("gone", [1, 4, 7])
def test_a_sequence_of_which_a_frame_is_missing_is_refused(gone: int) -> None:
    """A write that is killed leaves some frames; they must not pass for a shorter sequence."""
    files, _ = written(cache(), "walk.ply")
    del files.files[f"walk_{gone:05d}.ply"]
    with pytest.raises(FormatError, match=rf"'walk_0000{gone}.ply' is not there \(the sequence has 7 frames\)"):
        opened(files)


def test_one_frame_is_the_file_itself() -> None:
    files, _ = written(at_time(cache(), 2 / 30), "walk.ply")
    assert list(files.files) == ["walk.ply"]
    assert (positions_of(opened(files))[0] == positions_of(cache())[2]).all()


def test_frames_of_others_have_a_rate() -> None:
    mesh: Any = trimesh.Trimesh(np.eye(3), [[0, 1, 2]], process=False)
    files = Memory("a.ply", {f"a_{i}.ply": mesh.export(file_type="ply") for i in (9, 10, 11)})
    assert opened(files).times == pytest.approx(np.arange(3) / 24)
    assert opened(files, ReadOptions(input_fps=10)).times == pytest.approx(np.arange(3) / 10)


def test_quads_of_others_are_cut() -> None:
    text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1/1 2/2/1 3//1 -1\n"
    back = opened(Memory("a.obj", {"a.obj": text}))
    assert back.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert not back.has_normals


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({}, "nor is a_00001.obj"),
        ({"a.obj": b""}, "no vertices"),
        ({"a.obj": b"v 0 0 x\n"}, "line 1: 'x' is no number"),
        ({"a.obj": b"v 0 0 nan\n"}, "NaN"),
        ({"a.obj": b"v 0 0 0\nf 1 2 3\n"}, "line 2: a face uses vertex 3 of 1"),
        ({"a_1.obj": b"v 0 0 0\nv 0 0 1\n", "a_2.obj": b"v 0 0 0\n"}, "'a_2.obj' has 1 vertices"),
    ],
)
def test_what_is_wrong_is_said(files: dict[str, bytes], words: str) -> None:
    with pytest.raises(FormatError, match=words):
        opened(Memory("a.obj", files)).load_all()


@pytest.mark.parametrize("cut", [0, 20, 200, -3])
def test_a_cut_off_ply_is_refused(cut: int) -> None:
    files, _ = written(at_time(cache(), 0), "a.ply")
    with pytest.raises(FormatError):
        opened(Memory("a.ply", {"a.ply": files.files["a.ply"][:cut]})).load_all()
