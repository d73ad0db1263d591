"""Nodes with a `matrix` that a clip animates: read, edited and written as every player plays them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import anim.gltf.io.json_text as json_text
from anim.arrays import Floats
from anim.errors import FormatError
from anim.gltf import authoring
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.maths import matrix
from anim.model import Clip, Interpolation, Track
from anim.operations.resample import resample
from fixtures.broken.pieces import animated, text
from tests.files import opened
from tests.judge import judge, needs_judge
from tests.khronos import errors, needs_validator, validate

Find = Callable[[str], Path]
TURN = Rotation.from_euler("xyz", [0.3, -1.1, 2.0])


def composed(scale: list[float], translation: tuple[float, float, float] = (1, -2, 3)) -> Floats:
    whole = np.eye(4)
    whole[:3, :3] = TURN.as_matrix() * scale
    whole[:3, 3] = translation
    return np.asarray(whole, np.float32).astype(float)


def column_major(whole: Floats) -> list[float]:
    values: list[float] = whole.T.ravel().tolist()
    return values


def document_with(whole: Floats, **node: Any) -> Document:
    content = animated()
    content["nodes"] = [{"name": "hip", "matrix": column_major(whole), **node}, {"matrix": column_major(whole)}]
    return opened(text(content))


def local_matrix(node: dict[str, Any]) -> Floats:
    parts = (node.get("translation", [0, 0, 0]), node.get("rotation", [0, 0, 0, 1]), node.get("scale", [1, 1, 1]))
    rotation = Rotation.from_quat(parts[1]).as_matrix()
    return np.column_stack([rotation * parts[2], parts[0]])


@pytest.mark.parametrize(
    "scale",
    [
        [1, 1, 1],
        [2, 3, 0.5],
        [-1, 1, 1],
        [1, -2, 3],
        [-1, -2, -3],
        [0, 2, 3],
        [0, 0, 3],
        [0, 0, 0],
        [1e-7, 1, 1],
        [1e-6, 1e-6, 1],
        [100, 1e-3, 1],
    ],
)
def test_the_matrix_of_an_animated_node_becomes_trs(scale: list[float]) -> None:
    whole = composed(scale)
    document = document_with(whole, extras={"kept": 1})
    first, second = document.json["nodes"]
    assert "matrix" not in first
    assert first["extras"] == {"kept": 1}
    np.testing.assert_allclose(local_matrix(first), whole[:3], atol=3e-7 * max(1, *map(abs, scale)))
    assert second == {"matrix": column_major(whole)}  # nothing animates it
    assert document.expanded == (0,)


def test_noise_on_a_flat_matrix_is_no_shear() -> None:
    """What float32 leaves of an axis of length 0 points anywhere."""
    whole = composed([1, 1, 0])
    whole[:3, 2] = 1e-8, -2e-8, 3e-8
    node = document_with(whole).json["nodes"][0]
    np.testing.assert_allclose(local_matrix(node), whole[:3], atol=1e-6)


def test_a_shear_is_refused_with_advice() -> None:
    whole = composed([1, 1, 1])
    whole[0, 1] += 0.01
    with pytest.raises(FormatError, match=r"node 0 'hip': is animated and has a sheared matrix") as caught:
        document_with(whole)
    assert "export" in caught.value.help


@pytest.mark.parametrize(
    ("whole", "kind", "row"),
    [(np.zeros((4, 4)), "singular", "0, 0, 0, 0"), (np.eye(4) * 2, "projective", "0, 0, 0, 2")],
)
def test_a_last_row_that_is_not_0_0_0_1_is_named(whole: Floats, kind: str, row: str) -> None:
    with pytest.raises(FormatError, match=f"node 0 'hip': is animated and has a {kind} matrix") as caught:
        document_with(whole)
    assert caught.value.help.startswith(f"its last row is {row} (expected 0, 0, 0, 1)")


def test_what_is_the_identity_is_left_out() -> None:
    assert document_with(np.eye(4)).json["nodes"][0] == {"name": "hip"}


def test_a_pointer_at_the_rotation_counts_too() -> None:
    content = animated()
    target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/translation"}}}
    content["animations"][0]["channels"][0]["target"] = target
    content["nodes"] = [{"matrix": column_major(composed([2, 2, 2]))}]
    assert opened(text(content)).expanded == (0,)


def test_a_channel_written_to_a_matrix_takes_it_apart() -> None:
    """A new clip on a node that no clip of the file animates."""
    whole = composed([2, 1, 1])
    bare = opened(text({"asset": {"version": "2.0"}, "nodes": [{"matrix": column_major(whole)}] * 2}))
    assert bare.expanded == ()
    values = np.array([[0.0, 0, 0, 1], [0, 0, 1, 0]])
    track = Track(1, "rotation", Interpolation.LINEAR, np.array([0.0, 1]), values)
    written = authoring.add_clips(bare, [Clip("turn", (track,))])
    assert written.json["nodes"][0] == bare.json["nodes"][0]
    np.testing.assert_allclose(local_matrix(written.json["nodes"][1]), whole[:3], atol=1e-6)
    before, after = reader.skeleton(bare), reader.skeleton(written)
    np.testing.assert_allclose(after.scale, before.scale, atol=1e-6)


def with_matrices(path: Path) -> bytes:
    """The file with a matrix in place of the TRS of every node: what some exporters write."""
    document = container.read(np.fromfile(path, np.uint8))
    content = json.loads(json_text.dump(document.json))
    for node in content["nodes"]:
        whole = np.vstack([local_matrix(node), [0, 0, 0, 1]])
        for key in ("translation", "rotation", "scale"):
            node.pop(key, None)
        node["matrix"] = column_major(whole)
    changed = Document(content, document.buffers)
    return b"".join(piece.tobytes() for piece in container.glb(changed))


@pytest.mark.slow
@needs_judge
@needs_validator
@pytest.mark.parametrize("name", ["CesiumMan.glb", "Fox.glb"])
def test_real_files_with_matrices_play_as_three_plays_them(name: str, asset: Find, tmp_path: Path) -> None:
    """three.js opens such files as they are; the Khronos validator calls them invalid, and ours valid."""
    given, out = tmp_path / "given.glb", tmp_path / "out.glb"
    given.write_bytes(with_matrices(asset(name)))
    assert any("TARGET_NODE_MATRIX" in line for line in errors(validate(given.read_bytes())))
    document = container.read(np.fromfile(given, np.uint8))
    clips = reader.clips(document)
    dense = {i: resample(clip, fps=24) for i, clip in enumerate(clips[:1])}
    out.write_bytes(b"".join(piece.tobytes() for piece in container.glb(writer.replace_clips(document, dense))))
    assert errors(validate(out.read_bytes())) == []
    plain = tmp_path / "plain.glb"
    plain.write_bytes(b"".join(piece.tobytes() for piece in container.glb(document)))
    assert judge(given, plain).share < 1e-6
    first = judge(given, out).clips[0]
    before, after = (judge(asset(name), path).clips[0].max_error for path in (given, out))
    assert abs(after - first.max_error) < 1e-6 * judge(given, out).diagonal + before


def test_decomposing_gives_every_product_back() -> None:
    rng = np.random.default_rng(7)
    for _ in range(300):
        scale = rng.choice([-1, 1], 3) * 10 ** rng.uniform(-4, 4, 3)
        whole = np.asarray(Rotation.random(None, rng).as_matrix() * scale, np.float32).astype(float)
        parts = matrix.decompose(np.column_stack([whole, np.zeros(3)]))
        again = matrix.from_trs(*parts[:3])[:, :3]
        assert np.abs(again - whole).max() <= 1e-6 * np.abs(whole).max()
        assert parts[3] < 1e-4
