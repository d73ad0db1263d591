"""GLB: morph targets and flip-books, decoded by pygltflib and plain sums, and the Khronos validator agrees."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from pygltflib import GLTF2

from anim.arrays import AnyArray, Floats
from anim.caches.options import WriteOptions
from anim.caches.storage import Memory
from anim.caches.transforms.pca import fit_basis
from anim.caches.transforms.resample import reduce_frames
from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import FormatError, RangeError, UnsupportedError
from anim.model import VertexCache
from anim.model.vertex_cache import from_arrays
from tests.anim.caches.making import FACES, cache, normals_of, off, opened, positions_of, smooth, written
from tests.khronos import errors, needs_validator, validate_many

TYPES = {5121: "u1", 5122: "<i2", 5123: "<u2", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3}
LAYOUTS = ["morph", "flip-visibility", "flip-scale"]


def rows(gltf: GLTF2, number: int) -> AnyArray:
    """Decode an accessor by hand."""
    accessor: Any = gltf.accessors[number]
    view: Any = gltf.bufferViews[accessor.bufferView]
    dtype, width = np.dtype(TYPES[accessor.componentType]), WIDTHS[accessor.type]
    stride = view.byteStride or dtype.itemsize * width
    blob: Any = gltf.binary_blob()
    found = np.ndarray((accessor.count, width), dtype, blob, view.byteOffset, (stride, dtype.itemsize))
    return np.maximum(found / 32767, -1) if accessor.normalized else found


def played(data: bytes, times: Floats) -> AnyArray:
    """Positions (F, V, 3) at times by the rules of glTF, in as few lines as they take."""
    gltf: Any = GLTF2().load_from_bytes(data)
    (mesh,) = gltf.meshes
    (primitive,) = mesh.primitives
    base = rows(gltf, primitive.attributes.POSITION).astype(float)
    targets = np.array([rows(gltf, target["POSITION"]) for target in primitive.targets or []], float)
    if not len(targets):
        return np.broadcast_to(base, (len(times), *base.shape))
    (sampler,) = gltf.animations[0].samplers
    keys, weights = rows(gltf, sampler.input)[:, 0], rows(gltf, sampler.output).reshape(-1, len(targets))
    assert mesh.weights == pytest.approx(weights[0])
    assert weights.min() >= 0  # where players clamp
    assert weights.max() <= 1
    blend = np.stack([np.interp(times, keys, column) for column in weights.T], axis=1)
    placed: AnyArray = base + np.einsum("fm,mvi->fvi", blend, targets)
    return placed * (gltf.nodes[0].scale or (1, 1, 1))


@pytest.mark.parametrize("quantize", [False, True])
@pytest.mark.parametrize("limit", [0.3, 0.01, 1e-4])
@pytest.mark.parametrize("source", [smooth(), cache(20), cache(1)], ids=["smooth", "noise", "still"])
def test_every_frame_is_within_the_limit(source: VertexCache, limit: float, quantize: bool) -> None:
    files, said = written(source, "a.glb", WriteOptions(max_error=limit, quantize=quantize))
    placed = played(files.files["a.glb"], source.times)
    worst = np.linalg.norm(placed - positions_of(source), axis=-1).max()
    assert worst <= limit * (1 + 1e-5)
    assert said.max_error == pytest.approx(worst, abs=1e-6)


def test_between_frames_vertices_go_in_straight_lines() -> None:
    source = smooth()
    files, said = written(source, "a.glb", WriteOptions(max_error=1e-3))
    middle = (source.times[:-1] + source.times[1:]) / 2
    expected = (positions_of(source)[:-1] + positions_of(source)[1:]) / 2
    assert said.max_error is not None
    assert np.linalg.norm(played(files.files["a.glb"], middle) - expected, axis=-1).max() < said.max_error + 1e-6


def test_few_shapes_beat_many_frames_where_the_motion_is_smooth() -> None:
    files, said = written(smooth(), "a.glb", WriteOptions(max_error=1e-4))
    assert said.notes[0].startswith("2 morph targets (shapes and weights)")  # sine and cosine
    assert len(files.files["a.glb"]) < 40 * 60 * 12 / 5


def test_frames_that_lines_give_have_no_target() -> None:
    still, moved = np.zeros((1, 9, 3)), np.full((1, 9, 3), 1.0)
    moved[0, 3] = 2
    shares = np.array([0, 0.5, 1, 1.5, 2, 1, 0])[:, None, None]
    source = from_arrays(np.arange(7.0), still * (1 - shares) + moved * shares, FACES)
    _, said = written(source, "a.glb", WriteOptions(max_error=1e-5))
    assert said.notes[0] in (
        "1 morph target (shapes and weights), 7 keys for 7 frames",
        "1 morph target (shapes of kept frames), 3 keys for 7 frames",
    )
    assert reduce_frames(positions_of(source), source.times, 1e-5).tolist() == [0, 4, 6]


def test_noise_keeps_every_frame() -> None:
    source = cache(12)
    assert reduce_frames(positions_of(source), source.times, 1e-3).tolist() == list(range(12))
    assert fit_basis(positions_of(source), 1e-3, most=3) is None
    found = fit_basis(positions_of(source), 0.0, most=12)
    assert found is None or len(found.shapes) == 11  # a mean and eleven


def test_more_frames_than_memory_holds_products_of_are_refused() -> None:
    with pytest.raises(UnsupportedError, match="would take 80 GB"):
        fit_basis(np.zeros((100_000, 1, 3), np.float32), 1e-3, most=3)


@pytest.mark.parametrize("quantize", [False, True])
def test_normals_follow(quantize: bool) -> None:
    source = cache(6)
    files, _ = written(source, "a.glb", WriteOptions(max_error=1e-3, quantize=quantize))
    gltf: Any = GLTF2().load_from_bytes(files.files["a.glb"])
    primitive = gltf.meshes[0].primitives[0]
    weights = rows(gltf, gltf.animations[0].samplers[0].output).reshape(6, -1)
    base = rows(gltf, primitive.attributes.NORMAL)
    turns = np.array([rows(gltf, target["NORMAL"]) for target in primitive.targets])
    found = base + np.einsum("fm,mvi->fvi", weights, turns)
    found /= np.linalg.norm(found, axis=-1, keepdims=True)
    assert np.linalg.norm(base, axis=1) == pytest.approx(1)
    assert found == pytest.approx(normals_of(source), abs=1e-4)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("up", ["y", "z"])
def test_back_again(layout: str, up: str) -> None:
    source = to_up_axis(cache(), up)
    files, _ = written(source, "a.glb", WriteOptions(layout=layout, max_error=1e-5))
    back = opened(files)
    assert back.times == pytest.approx(source.times, abs=1e-7)
    assert off(back, source) < 1e-5
    assert back.faces.tolist() == FACES.tolist()
    assert back.up == up
    if layout != "morph":
        assert (positions_of(back) == positions_of(source)).all()
        assert (normals_of(back) == normals_of(source)).all()


@pytest.mark.parametrize("layout", ["flip-visibility", "flip-scale"])
def test_one_page_is_shown_at_a_time(layout: str) -> None:
    gltf: Any = GLTF2().load_from_bytes(written(cache(), "a.glb", WriteOptions(layout=layout))[0].files["a.glb"])
    for f, time in enumerate(np.arange(7) / 30):
        for when in (time + 1e-4, time + 0.03):
            shown = []
            for page, channel in enumerate(gltf.animations[0].channels):
                sampler = gltf.animations[0].samplers[channel.sampler]
                assert sampler.interpolation == "STEP"
                keys = rows(gltf, sampler.input)[:, 0]
                assert (np.diff(keys) > 0).all()
                value = rows(gltf, sampler.output)[max(int(np.searchsorted(keys, when, side="right")) - 1, 0)]
                if layout == "flip-visibility":
                    pointer = channel.target.extensions["KHR_animation_pointer"]["pointer"]
                    assert pointer == f"/nodes/{page + 1}/extensions/KHR_node_visibility/visible"
                else:
                    assert (channel.target.node, channel.target.path) == (page + 1, "scale")
                shown += [page] if value[0] else []
            assert shown == [f]


@needs_validator
def test_the_validator_finds_no_error() -> None:
    files = [
        written(source, "a.glb", WriteOptions(layout=layout, quantize=quantize))[0].files["a.glb"]
        for source in (cache(), cache(1), cache(2), smooth(), cache(normals=False))
        for layout in LAYOUTS
        for quantize in ((False, True) if layout == "morph" else (False,))
    ]
    for report in validate_many(files):
        assert errors(report) == []
        assert report["issues"]["numWarnings"] == 0


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_same_cache_gives_the_same_bytes(layout: str) -> None:
    one, other = (written(cache(step=step), "a.glb", WriteOptions(layout=layout))[0].files for step in (3, 7))
    assert one == other


def test_an_unknown_layout_is_refused() -> None:
    with pytest.raises(RangeError, match="expected morph"):
        written(cache(), "a.glb", WriteOptions(layout="flip"))


def test_a_flip_book_of_others_is_refused() -> None:
    nodes = [{"extras": {"gltf_anim": {"cache": "flipbook"}}, "children": [1]}, {}]
    text = json.dumps({"asset": {"version": "2.0"}, "nodes": nodes}).encode()
    with pytest.raises(FormatError, match="flip-book"):
        opened(Memory("a.glb", {"a.glb": text}))


def test_shapes_beyond_float32_are_no_encoding() -> None:
    """Two positions near its largest number gave shapes of NaN, with "max 0 mm"."""
    positions = np.zeros((5, 9, 3))
    positions[1, 0, 1], positions[4, 1, 2] = 3.31896e38, 2.75096e38
    with np.errstate(all="ignore"):
        files, result = written(from_arrays(np.arange(5.0), positions, FACES), "a.glb")
    assert result.max_error is not None
    assert np.isfinite(result.max_error)
    assert np.isfinite(played(files.files["a.glb"], np.arange(5.0))).all()
