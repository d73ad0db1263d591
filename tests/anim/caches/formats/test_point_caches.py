"""PC2 and MDD: by hand from the published layouts, with numpy alone, and byte for byte in a small case."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from anim.caches.options import ReadOptions, WriteOptions
from anim.caches.storage import Memory
from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import DataRangeError, FormatError, RangeError
from anim.model.vertex_cache import from_arrays
from tests.anim.caches.making import FACES, by_trimesh, cache, normals_of, opened, positions_of, written

TWO = from_arrays(np.array([0.0, 0.5]), np.array([[[1, 2, 3]], [[-1, 0.5, 4]]], np.float32), np.empty((0, 3), np.int64))


def test_pc2_by_hand() -> None:
    data = written(TWO, "a.pc2", WriteOptions(rest_mesh=""))[0].files["a.pc2"]
    assert data == (
        b"POINTCACHE2\0" + bytes.fromhex("01000000 01000000 00000000 0000803f 02000000")  # 1, 1 point, 0.0, 1.0, 2
        + bytes.fromhex("0000803f 00000040 00004040  000080bf 0000003f 00008040")
    )  # fmt: skip


def test_mdd_by_hand() -> None:
    data = written(TWO, "a.mdd", WriteOptions(rest_mesh=""))[0].files["a.mdd"]
    assert data == bytes.fromhex(
        "00000002 00000001 00000000 3f000000  3f800000 40000000 40400000  bf800000 3f000000 40800000"
    )


def test_pc2_by_numpy() -> None:
    source = cache(fps=24)
    data = written(source, "walk.pc2")[0].files["walk.pc2"]
    header = np.frombuffer(data[:32], [("magic", "S12"), ("i", "<i4", 2), ("f", "<f4", 2), ("frames", "<i4")])[0]
    assert header["magic"] == b"POINTCACHE2"
    assert header["i"].tolist() == [1, 9]
    assert header["f"].tolist() == [0, 1]
    assert header["frames"] == 7
    assert (np.frombuffer(data[32:], "<f4").reshape(7, 9, 3) == positions_of(source)).all()


def test_mdd_by_numpy() -> None:
    source = cache(fps=24)
    data = written(source, "walk.mdd")[0].files["walk.mdd"]
    assert np.frombuffer(data[:8], ">i4").tolist() == [7, 9]
    assert np.frombuffer(data[8:36], ">f4") == pytest.approx(source.times)
    assert (np.frombuffer(data[36:], ">f4").reshape(7, 9, 3) == positions_of(source)).all()


def test_mdd_has_no_two_frames_at_one_time_in_float32() -> None:
    """Found by fuzzing: the reader refused what was written."""
    close = from_arrays(np.array([0.0, 1e-243]), np.zeros((2, 1, 3), np.float32), np.empty((0, 3), np.int64))
    with pytest.raises(DataRangeError, match="frames 0 and 1, 1e-243 s apart, are at one time in float32"):
        written(close, "a.mdd", WriteOptions(rest_mesh=""))


@pytest.mark.parametrize("name", ["walk.pc2", "walk.mdd"])
@pytest.mark.parametrize("ending", [".ply", ".obj"])
def test_the_rest_mesh_has_the_same_order(name: str, ending: str) -> None:
    source = cache()
    files, _ = written(source, name, WriteOptions(rest_mesh=ending))
    assert sorted(files.files) == sorted([name, f"{name}-rest{ending}"])
    mesh = by_trimesh(files.files[f"{name}-rest{ending}"], ending)
    assert mesh.vertices == pytest.approx(source.rest, abs=1e-6)
    assert mesh.faces.tolist() == FACES.tolist()
    back = opened(files)
    assert (back.faces == FACES).all()
    assert back.rest == pytest.approx(source.rest, abs=1e-6)


@pytest.mark.parametrize("name", ["walk.pc2", "walk.mdd"])
def test_back_again(name: str) -> None:
    source = cache()
    back = opened(written(source, name)[0])
    assert (positions_of(back) == positions_of(source)).all()
    assert back.times == pytest.approx(source.times, abs=1e-7)  # of PC2 by the rate that the rest mesh keeps
    assert written(back, name)[0].files[name] == written(source, name)[0].files[name]


def test_a_pc2_without_its_rest_mesh() -> None:
    files = Memory("a.pc2", {"a.pc2": written(cache(), "a.pc2")[0].files["a.pc2"]})
    assert opened(files).times[1] == pytest.approx(1 / 24)
    assert opened(files, ReadOptions(input_fps=10)).times[1] == pytest.approx(0.1)
    assert len(opened(files).faces) == 0


def test_pc2_says_start_and_rate_of_later_frames() -> None:
    source = cache(fps=24)
    later = from_arrays(source.times + 0.5, positions_of(source), FACES)
    data = written(later, "a.pc2")[0].files["a.pc2"]
    assert struct.unpack("<ff", data[20:28]) == (12.0, 1.0)
    assert opened(written(later, "a.pc2")[0]).times == pytest.approx(later.times, abs=1e-6)


def test_pc2_refuses_uneven_steps_but_takes_a_short_last_one() -> None:
    positions = np.zeros((4, 3, 3), np.float32)
    with pytest.raises(RangeError, match=r"frame 2 at 0\.7 s"):
        written(from_arrays(np.array([0, 0.1, 0.7, 0.8]), positions, FACES[:1]), "a.pc2")
    _, said = written(from_arrays(np.array([0, 0.1, 0.2, 0.25]), positions, FACES[:1]), "a.pc2")
    assert "last frame is at 0.25 s" in said.notes[0]


def test_blenders_axes() -> None:
    source = cache()
    turned_back = to_up_axis(to_up_axis(source, "z"), "y")
    x, y, z = np.moveaxis(positions_of(source), -1, 0)
    data = written(to_up_axis(source, "z"), "a.pc2")[0].files["a.pc2"]
    assert (np.frombuffer(data[32:], "<f4").reshape(7, 9, 3) == np.stack((x, -z, y), axis=-1)).all()
    assert (positions_of(turned_back) == positions_of(source)).all()
    assert (normals_of(turned_back) == normals_of(source)).all()
    assert opened(written(to_up_axis(source, "z"), "a.pc2")[0]).up == "z"


@pytest.mark.parametrize("name", ["a.pc2", "a.mdd"])
@pytest.mark.parametrize("cut", [0, 5, 31, 40, -1])
def test_cut_off_files_are_refused(name: str, cut: int) -> None:
    data = written(cache(), name)[0].files[name]
    with pytest.raises(FormatError, match="truncated"):
        opened(Memory(name, {name: data[:cut]}))


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.pc2", b"POINTCACHE2\0" + struct.pack("<iiffi", 1, 1, 0, 1, 1) + b"\0" * 13),
        ("a.pc2", b"POINTCACHE3\0" + struct.pack("<iiffi", 1, 1, 0, 1, 1) + b"\0" * 12),
        ("a.pc2", b"POINTCACHE2\0" + struct.pack("<iiffi", 2, 1, 0, 1, 1) + b"\0" * 12),
        ("a.pc2", b"POINTCACHE2\0" + struct.pack("<iiffi", 1, -1, 0, 1, 1)),
        ("a.pc2", b"POINTCACHE2\0" + struct.pack("<iiffi", 1, 1, 0, 0, 1) + b"\0" * 12),
        ("a.mdd", struct.pack(">iiff", 2, 1, 0, 0) + b"\0" * 24),  # two frames at one time
        ("a.mdd", struct.pack(">iif", 1, 1, 0) + struct.pack(">fff", 0, float("nan"), 0)),
        ("a.mdd", struct.pack(">ii", 0, 0)),
    ],
)
def test_wrong_headers_are_refused(name: str, data: bytes) -> None:
    with pytest.raises(FormatError):
        opened(Memory(name, {name: data})).load_all()
