"""Blender as a judge: it sees what it should, in our axes, and it clamps weights."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pygltflib import Animation, AnimationChannel, AnimationChannelTarget, AnimationSampler, Mesh, Node

from anim.arrays import Floats
from anim.caches.formats.gltf_stream import GlbFile, primitive
from anim.caches.storage import Memory
from anim.gltf.authoring_parts import VERTICES
from tests.blender import needs_blender, vertices

pytestmark = [pytest.mark.slow, needs_blender]

TRIANGLE = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0]], "<f4")
MOVED = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 5]], "<f4")  # toward the viewer, by its tip


def test_axes_clips_and_times_between_frames(tmp_path: Path) -> None:
    path = _written(tmp_path, {"half": [0, 0.5], "whole": [0, 1]})
    times = [0, 0.25 / 3, 1.0]
    for name, end in (("half", 0.5), ("whole", 1)):
        (found,) = vertices(path, times, clip=name).values()
        for frame, time in zip(found, times, strict=True):
            assert frame == pytest.approx(_at(end * time), abs=1e-6)


def test_a_weight_above_1_is_clamped(tmp_path: Path) -> None:
    """Its importer widens the slider by the first key only."""
    (found,) = vertices(_written(tmp_path, {"later": [0.0, 2.0]}), [0, 1], clip="later").values()
    assert found[1] == pytest.approx(_at(1), abs=1e-6)


def test_what_is_no_gltf_is_refused_in_blenders_words(tmp_path: Path) -> None:
    (tmp_path / "no.glb").write_bytes(b"no")
    with pytest.raises(RuntimeError, match=r"^no.glb: "):
        vertices(tmp_path / "no.glb", [0])


def _at(weight: float) -> Floats:
    return TRIANGLE.astype(float) + weight * MOVED


def _written(folder: Path, clips: dict[str, list[float]]) -> Path:
    """A triangle with one target, and clips of a second that take its weight from one value to another."""
    file = GlbFile()
    gltf: Any = file.gltf
    corners = file.add(TRIANGLE, target=VERTICES, bounds=True)
    targets = [{"POSITION": file.add(MOVED, target=VERTICES, bounds=True)}]
    indices = file.add_indices(np.array([[0, 1, 2]]), 3)
    gltf.meshes.append(Mesh(primitives=[primitive({"POSITION": corners}, indices, targets)]))
    gltf.nodes.append(Node(name="one", mesh=0))
    gltf.scenes[0].nodes.append(0)
    keys = file.add(np.array([[0.0], [1.0]], "<f4"), bounds=True)
    for name, weights in clips.items():
        sampler = AnimationSampler(input=keys, output=file.add(np.array(weights, "<f4")[:, None]))
        channel = AnimationChannel(sampler=0, target=AnimationChannelTarget(node=0, path="weights"))
        gltf.animations.append(Animation(name=name, channels=[channel], samplers=[sampler]))
    memory = Memory("a.glb")
    file.write(memory, "a.glb")
    (folder / "a.glb").write_bytes(memory.files["a.glb"])
    return folder / "a.glb"
