"""The body of sticks: where the joints are at rest, closed, and hung on the right joints."""

from __future__ import annotations

import numpy as np

from anim.exchange.split_skins import split_by_root
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf import authoring
from anim.gltf.reading import reader
from anim.model import Skeleton
from tests.clips import skeleton
from tests.files import glb_of, opened

# A turned arm with a forearm that has no length, a hand, and an End Site.
HALF = np.sqrt(0.5)
ARM = Skeleton(
    ("arm", "forearm", "hand", "hand_end"),
    np.array([-1, 0, 1, 2]),
    np.array([[0, 1.0, 0], [0, 0, 0], [2, 0, 0], [1, 0, 0]]),
    np.array([[0, 0, HALF, HALF], [0, 0, 0, 1], [0, 0, 0, 1], [0, 0, 0, 1]]),
    np.ones((4, 3)),
)


def test_a_stick_to_each_child_that_is_apart() -> None:
    mesh, skin = stick_mesh(ARM, frozenset({3}))
    assert skin.joints.tolist() == [0, 1, 2]
    knobs = 1  # of the arm, whose only child stands where it stands
    assert len(mesh.faces) == 8 * (2 + knobs)
    assert sorted(set(mesh.joints[:, 0].tolist())) == [0, 1, 2]
    hand = mesh.positions[mesh.joints[:, 0] == 2]
    np.testing.assert_allclose((hand[:, 1].min(), hand[:, 1].max()), (3, 4), atol=1e-12)


def test_each_is_closed_with_normals_outward() -> None:
    mesh, _ = stick_mesh(ARM, frozenset({3}))
    assert mesh.normals is not None
    triangles = mesh.positions[mesh.faces]
    for first in range(0, len(triangles), 8):
        own = triangles[first : first + 8]
        volume = np.einsum("ti,ti->t", own[:, 0], np.cross(own[:, 1], own[:, 2])).sum() / 6
        assert volume > 0
        edges = {(tuple(a), tuple(b)) for t in own for a, b in zip(t, np.roll(t, -1, axis=0), strict=True)}
        assert {(b, a) for a, b in edges} == edges
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert (np.einsum("ti,ti->t", across, mesh.normals[mesh.faces[:, 0]]) > 0).all()


def test_the_skin_holds_it_where_it_is_at_rest() -> None:
    written = opened(glb_of(authoring.build_document(ARM, [], [stick_mesh(ARM, frozenset({3}))])))
    instance = reader.scene(written).instances[0]
    assert instance.skin is not None
    places = np.array([[0, 1, 0], [0, 1, 0], [0, 3, 0]])
    for bind, place in zip(instance.skin.inverse_bind, places, strict=True):
        np.testing.assert_allclose(bind[:, :3] @ place + bind[:, 3], 0, atol=1e-6)


def test_each_tree_gets_a_body_of_its_own() -> None:
    two = Skeleton(
        (*ARM.names, "ball", "string"),
        np.array([-1, 0, 1, 2, -1, 4]),
        np.concatenate((ARM.translation, np.array([[5.0, 0, 0], [0, -1, 0]]))),
        np.concatenate((ARM.rotation, np.tile((0, 0, 0, 1.0), (2, 1)))),
        np.ones((6, 3)),
    )
    whole, skin = stick_mesh(two, frozenset({3}))
    bodies = split_by_root(two, whole, skin)
    assert [own.joints.tolist() for _, own in bodies] == [[0, 1, 2], [4, 5]]
    assert [mesh.name for mesh, _ in bodies] == ["sticks 1", "sticks 2"]
    drawn = np.concatenate([mesh.positions[mesh.faces] for mesh, _ in bodies])
    assert {each.tobytes() for each in drawn} == {each.tobytes() for each in whole.positions[whole.faces]}
    for mesh, own in bodies:
        for corner, joint in zip(mesh.positions, own.joints[mesh.joints[:, 0]], strict=True):
            same = (whole.positions == corner).all(axis=1)
            assert joint in skin.joints[whole.joints[same, 0]]
    assert split_by_root(ARM, *stick_mesh(ARM))[0][0].name == "sticks"


def test_a_single_joint_shows_too() -> None:
    point = Skeleton(("a",), np.array([-1]), np.zeros((1, 3)), np.array([[0, 0, 0, 1.0]]), np.ones((1, 3)))
    assert len(stick_mesh(point)[0].faces) == 8


def test_trees_beyond_a_number_of_meshes_share_one() -> None:
    trees = skeleton([-1] * 7, translation=np.eye(7, 3))
    whole, skin = stick_mesh(trees)
    bodies = split_by_root(trees, whole, skin, max_meshes=3)
    assert [each.joints.tolist() for _, each in bodies] == [[0, 1, 2], [3, 4, 5], [6]]
    np.testing.assert_array_equal(np.concatenate([mesh.positions for mesh, _ in bodies]), whole.positions)
    owners = [own.joints[mesh.joints[:, 0]] for mesh, own in bodies]
    np.testing.assert_array_equal(np.concatenate(owners), skin.joints[whole.joints[:, 0]])
    assert [len(split_by_root(trees, whole, skin, max_meshes=count)) for count in (1, 7, 9)] == [1, 7, 7]
