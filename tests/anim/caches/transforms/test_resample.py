"""Other times, other orders, and the table of formats."""

from __future__ import annotations

import numpy as np
import pytest

from anim.caches.registry import CACHE_FORMATS, reader_for, sniff_format
from anim.caches.transforms import statistics
from anim.caches.transforms.resample import at_rate, at_time, resample_frames
from anim.caches.transforms.vertex_order import reorder
from anim.errors import FormatError, RangeError, UnsupportedError
from anim.model import MeshPart
from anim.model.vertex_cache import from_arrays
from tests.anim.caches.making import cache, positions_of, written


def test_between_frames_lie_straight_lines() -> None:
    source = cache()
    found = resample_frames(source, np.array([0.0, 1.5 / 30, 5.25 / 30, 9.0, 10.0]))
    p = positions_of(source)
    expected = np.stack((p[0], (p[1] + p[2]) / 2, 0.75 * p[5] + 0.25 * p[6], p[6], p[6]))
    assert positions_of(found) == pytest.approx(expected, abs=1e-6)


def test_many_new_frames_from_a_stream() -> None:
    source = cache(50, step=1)
    found = at_rate(source, 200)
    whole = found.load_all()
    p = positions_of(source)
    for axis in range(3):
        expected = np.interp(found.times, source.times, p[:, 4, axis])
        assert whole.positions[:, 4, axis] == pytest.approx(expected, abs=1e-5)
    assert whole.normals is not None
    assert np.linalg.norm(whole.normals, axis=-1) == pytest.approx(1, abs=1e-5)


def test_its_own_rate_changes_nothing() -> None:
    source = cache()
    assert at_rate(source, 30) is source


def test_one_frame() -> None:
    assert (positions_of(at_time(cache(), 3 / 30))[0] == positions_of(cache())[3]).all()
    with pytest.raises(RangeError, match="no frame at 1 s"):
        at_time(cache(), 1.0)


def test_blenders_order_leaves_unused_vertices_out() -> None:
    source = cache()  # vertex 8 is in no face, and part two has it
    found = reorder(source, "blender")
    assert found.vertex_count == 8
    assert (positions_of(found) == positions_of(source)[:, :8]).all()
    assert found.parts == (source.parts[0], MeshPart("two", (4, 8), (2, 4), 5, 1))
    assert reorder(source, "file") is source


def test_blenders_order_keeps_points() -> None:
    source = cache()
    points = source.__class__(
        source.times, 9, source.faces[:2], source.chunks, parts=(source.parts[0], MeshPart("points", (4, 9), (2, 2)))
    )
    assert reorder(points, "blender").vertex_count == 9


def test_the_size_of_a_model_is_that_of_its_rest_pose_however_far_it_travels() -> None:
    box = np.array([[0.0, 0, 0], [1, 2, 2]])
    far = np.stack([box, 0.5 * box + [100, 0, 0]]).astype(np.float32)
    faces = np.empty((0, 3), np.int64)
    assert statistics.diagonal(from_arrays(np.array([0.0, 1]), far, faces)) == pytest.approx(3)
    assert statistics.diagonal(from_arrays(np.array([0.0, 1]), far, faces, rest=2 * box)) == pytest.approx(6)
    collapsed = from_arrays(np.array([0.0, 1]), far, faces, rest=0 * box)
    assert statistics.diagonal(collapsed) == pytest.approx(3)


@pytest.mark.parametrize("ending", [".npz", ".pc2", ".mdd", ".usdc", ".usda", ".glb"])
def test_formats_are_known_by_their_first_bytes(ending: str) -> None:
    data = written(cache(), f"a{ending}")[0].files[f"a{ending}"]
    assert sniff_format(data[:64], len(data)) == ending


@pytest.mark.parametrize("data", [b"", b"hello", b"\0" * 40])
def test_other_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(FormatError):
        sniff_format(data, len(data))


def test_other_endings_are_refused() -> None:
    with pytest.raises(UnsupportedError, match=r"\.npz"):
        reader_for(".fbx")


@pytest.mark.parametrize("ending", CACHE_FORMATS)
def test_chunks_don_t_matter(ending: str) -> None:
    assert written(cache(step=1), f"a{ending}")[0].files == written(cache(step=7), f"a{ending}")[0].files
