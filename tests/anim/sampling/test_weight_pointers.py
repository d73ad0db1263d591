"""Morph weights by JSON pointers against a plain loop that follows the specification, on odd files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.model import Clip, Interpolation, MorphedNode, Skeleton, Track
from anim.sampling.clips import sample_clips
from anim.sampling.pose import sample_pose
from anim.sampling.track import sample
from anim.sampling.weight_pointers import ineffective_weight_pointers, resolve_weight_pointers
from tests.clips import skeleton

REST = (0.25, -0.5, 2.0)
# Nodes 0 and 1 have mesh 4, node 2 too with weights of its own; node 3 has mesh 5.
MORPHED = (
    MorphedNode(0, 4, REST, False),
    MorphedNode(1, 4, REST, False),
    MorphedNode(2, 4, (1.0, 1.0, 1.0), True),
    MorphedNode(3, 5, (0.0, 0.5), False),
)
NODES = replace(skeleton([-1, -1, 0, 2]), morphed=MORPHED)
AT = np.concatenate((np.linspace(-0.5, 4, 451), np.nextafter([1.0, 1.5, 2.0, 2.5, 3.0], 0)))
STEP, LINEAR, CUBIC = Interpolation.STEP, Interpolation.LINEAR, Interpolation.CUBICSPLINE


def _pointer(pointer: str, width: int, kind: Interpolation = LINEAR, times: Sequence[float] = (1, 2, 3)) -> Track:
    random = np.random.default_rng(len(pointer) + 7 * width + len(times))
    values, *tangents = random.normal(size=(3, len(times), width))
    more: dict[str, Any] = dict(zip(("in_tangents", "out_tangents"), tangents, strict=True)) if kind is CUBIC else {}
    return Track(None, "pointer", kind, times, values, pointer=pointer, **more)


def _weights(node: int, width: int) -> Track:
    track = _pointer(f"/nodes/{node}/weights", width)
    return Track(node, "weights", track.interpolation, track.times, track.values, pointer=track.pointer)


def _expected(clip: Clip, each: MorphedNode, at: Floats) -> Floats:
    """Weights of a node by the words of the specification: its mesh's, unless it has its own; then single ones."""
    found = np.tile(each.weights, (len(at), 1))
    tracks = {track.pointer: track for track in clip.tracks}
    own = f"/nodes/{each.node}/weights"
    chain = [own] if each.has_own or own in tracks else [f"/meshes/{each.mesh}/weights", own]
    for owner in chain:
        if owner in tracks and tracks[owner].values.shape[1] == found.shape[1]:
            found = sample(tracks[owner], at)
        for i in range(found.shape[1]):
            if (single := tracks.get(f"{owner}/{i}")) is not None:
                found[:, i] = sample(single, at)[:, 0]
    return found


CLIPS = {
    "mesh": (_pointer("/meshes/4/weights", 3),),
    "one weight of a mesh": (_pointer("/meshes/4/weights/1", 1),),
    "one weight of a node": (_pointer("/nodes/1/weights/2", 1),),
    "mesh and one of its weights": (_pointer("/meshes/4/weights", 3), _pointer("/meshes/4/weights/0", 1)),
    "one of its weights and mesh": (_pointer("/meshes/4/weights/0", 1), _pointer("/meshes/4/weights", 3)),
    "mesh and a node's": (_pointer("/meshes/4/weights", 3), _weights(1, 3)),
    "mesh and one of a node's": (_pointer("/meshes/4/weights", 3), _pointer("/nodes/0/weights/0", 1)),
    "own weights and one of them": (_weights(2, 3), _pointer("/nodes/2/weights/1", 1, times=(0.5, 2.5))),
    "jumps": (_pointer("/meshes/4/weights", 3, STEP), _pointer("/meshes/5/weights", 2, STEP)),
    "splines": (_pointer("/meshes/4/weights", 3, CUBIC), _pointer("/meshes/4/weights/2", 1, CUBIC)),
    "other times": (_pointer("/meshes/4/weights/0", 1), _pointer("/meshes/4/weights/1", 1, times=(1.5, 1.6, 3.5))),
    "lines and jumps": (_pointer("/meshes/4/weights/0", 1), _pointer("/meshes/4/weights/1", 1, STEP, (1.5, 2.0, 2.5))),
    "lines and splines": (
        _pointer("/meshes/4/weights", 3),
        _pointer("/meshes/4/weights/1", 1, CUBIC, (0.5, 1.5, 2.5, 3.5)),
    ),
    "all kinds": (
        _pointer("/meshes/4/weights/0", 1),
        _pointer("/meshes/4/weights/1", 1, CUBIC, (0.5, 1.5, 2.5)),
        _pointer("/nodes/1/weights/2", 1, STEP, (1, 1.5, 2)),
    ),
    "one key": (_pointer("/meshes/4/weights/0", 1, STEP, (2,)), _pointer("/meshes/4/weights/1", 1)),
}


@pytest.mark.parametrize("tracks", CLIPS.values(), ids=CLIPS)
def test_poses_have_the_weights_of_the_specification(tracks: tuple[Track, ...]) -> None:
    clip = Clip("", tracks)
    found = sample_pose(NODES, clip, AT).weights
    _, (again,) = sample_clips(NODES, [clip], AT[None])
    assert ineffective_weight_pointers(NODES, clip) == []
    for each in MORPHED:
        expected = _expected(clip, each, AT)
        rest = np.tile(each.weights, (len(AT), 1))
        np.testing.assert_allclose(found.get(each.node, rest), expected, atol=1e-12)
        np.testing.assert_allclose(again.get(each.node, rest), expected, atol=1e-12)


def test_only_moved_nodes_have_tracks() -> None:
    clip = Clip("", CLIPS["mesh"])
    new = resolve_weight_pointers(NODES, clip)
    assert [track.target for track in new.tracks] == [(0, "weights"), (1, "weights")]
    assert new.tracks[0].time_axis is clip.tracks[0].time_axis
    assert np.shares_memory(new.tracks[0].values, new.tracks[1].values)
    assert resolve_weight_pointers(NODES, new) is new


@pytest.mark.parametrize(
    "pointer", ["/meshes/9/weights", "/meshes/4/weights/3", "/nodes/7/weights/0", "/meshes/5/weights"]
)
def test_pointers_to_no_weights_move_nothing(pointer: str) -> None:
    clip = Clip("", (_pointer(pointer, 1),))
    assert resolve_weight_pointers(NODES, clip) is clip
    assert ineffective_weight_pointers(NODES, clip) == [pointer]


@pytest.mark.parametrize("pointer", ["/meshes/4/weights/1", "/nodes/0/weights/1"])
def test_two_tracks_of_one_pointer_are_not_ineffective(pointer: str) -> None:
    clip = Clip("", (_pointer(pointer, 1), _pointer(pointer, 1, times=(1, 2, 4))))
    assert ineffective_weight_pointers(NODES, clip) == []
    np.testing.assert_array_equal(resolve_weight_pointers(NODES, clip).tracks[-1].times, (1, 2, 4))


def test_weights_of_nodes_replace_those_of_their_mesh() -> None:
    own = replace(NODES, morphed=(MORPHED[2],))
    clip = Clip("", (_pointer("/meshes/4/weights", 3), _pointer("/materials/0/alphaCutoff", 1)))
    assert resolve_weight_pointers(own, clip) is clip
    assert ineffective_weight_pointers(own, clip) == ["/meshes/4/weights"]
    both = Clip("", (*CLIPS["mesh"], _weights(0, 3), _weights(1, 3)))
    assert ineffective_weight_pointers(NODES, both) == ["/meshes/4/weights"]


def test_many_targets_of_one_pointer_each() -> None:
    nodes = replace(skeleton([-1]), morphed=(MorphedNode(0, 0, (0.0,) * 300, False),))
    axis = CLIPS["mesh"][0].time_axis
    values = [np.full((3, 1), i / 300) for i in range(300)]
    tracks = [Track(None, "pointer", LINEAR, axis, v, pointer=f"/meshes/0/weights/{i}") for i, v in enumerate(values)]
    (made,) = resolve_weight_pointers(nodes, Clip("", tuple(tracks))).tracks
    assert made.time_axis is axis
    np.testing.assert_array_equal(made.values, np.tile(np.arange(300) / 300, (3, 1)))


def test_a_skeleton_without_meshes_knows_no_weights() -> None:
    bare: Skeleton = replace(NODES, morphed=())
    assert resolve_weight_pointers(bare, Clip("", CLIPS["mesh"])).tracks == CLIPS["mesh"]
