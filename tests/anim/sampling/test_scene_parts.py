"""Parts of a scene that clips move: as the whole scene, with fewer nodes."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.error.surface import place_points, surfaces
from anim.model import Clip, MorphedNode, Scene
from anim.sampling.clips import sample_world_matrices
from anim.sampling.scene_parts import SceneDivider, select_nodes
from tests.arms import arms
from tests.clips import clip, skeleton, track
from tests.files import opened

TIMES = np.linspace(0, 1.1, 9)
ARMS = opened(arms(40))
SCENE, CLIPS = reader.scene(ARMS), reader.clips(ARMS)


def _world(scene: Scene, one: Clip) -> np.ndarray:
    return sample_world_matrices(scene.skeleton, [one], TIMES[None])[0]


def _points(scene: Scene, world: np.ndarray) -> dict[str, np.ndarray]:
    """Vertices (F, V, 3) of all surfaces; those of a node by its name."""
    found: dict[str, list[np.ndarray]] = {}
    for each in surfaces(scene):
        own = [place_points(each, world[each.nodes, f], each.rest_weights) for f in range(world.shape[1])]
        found.setdefault(scene.skeleton.display_name(each.owner), []).append(np.array(own))
    return {name: np.concatenate(each, axis=1) for name, each in found.items()}


@pytest.mark.parametrize("number", range(8))
def test_a_part_moves_as_in_the_whole_scene(number: int) -> None:
    one = CLIPS[number]
    part = SceneDivider(SCENE).part([one])
    assert part is not None
    assert len(part.nodes) < 12
    own, world = _world(part.scene, part.into(one)), _world(SCENE, one)
    assert (own == world[part.nodes]).all()
    names = [SCENE.skeleton.display_name(node) for node in part.nodes.tolist()]
    assert [part.scene.skeleton.display_name(i) for i in range(len(names))] == names
    of_part, of_whole = _points(part.scene, own), _points(SCENE, world)
    for name, points in of_whole.items():
        if np.ptp(points, axis=0).any():
            np.testing.assert_array_equal(of_part[name], points)


def test_clips_go_into_a_part_and_come_back() -> None:
    part = SceneDivider(SCENE).part(CLIPS[5:7])
    assert part is not None
    for one in CLIPS[5:7]:
        again = part.out_of(part.into(one))
        assert [(each.target, each.time_axis) for each in again.tracks] == [
            (each.target, each.time_axis) for each in one.tracks
        ]
        assert all((a.values == b.values).all() for a, b in zip(again.tracks, one.tracks, strict=True))


def test_every_part_has_vertices_if_the_scene_has_some() -> None:
    part = SceneDivider(SCENE).part([CLIPS[2]])  # an arm without a mesh
    assert part is not None
    assert part.scene.vertex_count == 3


def test_instances_with_one_skin_have_one_in_a_part() -> None:
    (skin,) = {each.skin for each in SCENE.instances if each.node == 4 * 40}
    twice = Scene(SCENE.skeleton, (*SCENE.instances, *(each for each in SCENE.instances if each.skin is skin)))
    part = SceneDivider(twice).part([CLIPS[3]])
    assert part is not None
    assert len({each.skin for each in part.scene.instances}) == 1 < len(part.scene.instances)


def test_batches_have_all_clips_once_and_few_nodes() -> None:
    everywhere = clip(*(track("scale", [0], [[1, 1, 1]], node=node) for node in range(len(SCENE.skeleton))))
    clips = [*CLIPS[:20], everywhere, *CLIPS[20:]]
    batches = list(SceneDivider(SCENE).batches(clips, 60))
    assert sorted(i for numbers, _ in batches for i in numbers) == list(range(len(clips)))
    assert batches[0][0] == [20]
    assert batches[0][1] is None
    for numbers, part in batches[1:]:
        assert part is not None
        assert len(numbers) == 1 or len(numbers) * len(part.nodes) <= 60


def test_no_part_of_most_nodes_or_of_small_scenes_or_with_pointers_to_weights() -> None:
    scene = Scene(skeleton([-1] * 100), ())
    assert SceneDivider(scene).part([clip(*(track("scale", [0], [[1, 1, 1]], node=n) for n in range(26)))]) is None
    assert SceneDivider(scene).part([clip(*(track("scale", [0], [[1, 1, 1]], node=n) for n in range(25)))]) is not None
    assert SceneDivider(scene).part([clip(track("/nodes/3/weights", [0], [[1]]))]) is None
    below = Scene(skeleton([-1, *range(99)]), ())
    assert SceneDivider(below).part([clip(track("scale", [0], [[1, 1, 1]], node=3))]) is None
    small = Scene(skeleton([-1] * 10), ())
    assert SceneDivider(small).part([clip(track("scale", [0], [[1, 1, 1]], node=3))]) is None
    assert SceneDivider(small).part_nodes([]) is None
    assert SceneDivider(scene).part([clip()]) is None
    assert [(numbers, part) for numbers, part in SceneDivider(scene).batches([clip()] * 3, 60)] == [([0, 1, 2], None)]


def test_nodes_with_morph_targets_stay_with_their_weights() -> None:
    morphed = tuple(MorphedNode(node, node // 2, (0.5, node / 100), has_own=True) for node in (3, 40, 41, 99))
    found = select_nodes(skeleton([-1] * 100, morphed=morphed), np.array([3, 8, 41]))
    assert found.morphed == (morphed[0]._replace(node=0), morphed[2]._replace(node=2))


def test_sheared_nodes_keep_their_matrices() -> None:
    matrix = np.array([[[1, 0.5, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3]]])
    bent = skeleton([-1] * 99 + [98], sheared=[98], sheared_local=matrix)
    one = clip(track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]], node=99))
    part = SceneDivider(Scene(bent, ())).part([one])
    assert part is not None
    assert part.nodes.tolist() == [98, 99]
    assert (_world(part.scene, part.into(one)) == _world(Scene(bent, ()), one)[[98, 99]]).all()
