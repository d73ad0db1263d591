"""Baking: order, spaces, normals, morph targets, chunks; and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.errors import FormatError, NotFoundError, RangeError
from anim.gltf.document import Json
from anim.gltf.reading import reader
from anim.maths import matrix
from anim.measure.error.surface import place_points, surfaces
from anim.model import Clip, MeshInstance, Scene
from anim.sampling import sample_pose, world_matrices
from anim.skinning import chunk_pipeline
from anim.skinning.analysis.weight_sums import unnormalized_weights
from anim.skinning.bake import bake, prepare_bake
from anim.skinning.methods.registry import SKINNING_METHODS
from fixtures.broken.pieces import buffered, text
from tests.anim.skinning.methods.test_linear_blend import TIMES, moving
from tests.anim.skinning.scenes import TRIANGLE, mesh, random_scene, scene
from tests.clips import about, clip, skeleton, track
from tests.files import ASSETS, opened, opened_fixture, opened_path


@pytest.mark.parametrize("name", ["biped", "morph_cube", "arm", "accessors", "interpolations", "pointer"])
def test_every_mesh_in_order_as_the_ruler_places_it(name: str) -> None:
    """`measure.surface` places vertices by its own loop, for the error bound: both must mean the same."""
    of = reader.scene(opened_fixture(name))
    for played in reader.clips(opened_fixture(name)):
        times = np.linspace(played.start, played.end, 37)
        cache = bake(of, played, times=times, rigid=True)
        local = sample_pose(of.skeleton, played, times)
        world, at = world_matrices(of.skeleton, local), 0
        whole = cache.load_all().positions
        for surface in surfaces(of):
            weights = local.weights.get(surface.owner, np.tile(surface.rest_weights, (len(times), 1)))
            frames = [place_points(surface, world[f][surface.nodes], weights[f]) for f in range(len(times))]
            span = slice(at, at + len(surface.points))
            assert np.abs(whole[:, span] - np.stack(frames)).max() < 1e-6 * max(1, np.abs(frames).max())
            at += len(surface.points)
        assert at == cache.vertex_count == of.vertex_count


def test_parts_are_the_primitives_in_order() -> None:
    of = reader.scene(opened_fixture("biped"))
    cache = bake(of, Clip("", ()), times=np.zeros(1))
    assert [part.vertices[0] for part in cache.parts] == [0, *(part.vertices[1] for part in cache.parts[:-1])]
    assert cache.parts[-1].vertices[1] == cache.vertex_count
    assert [part.faces[0] for part in cache.parts] == [0, *(part.faces[1] for part in cache.parts[:-1])]
    assert cache.parts[-1].faces[1] == len(cache.faces)
    for part in cache.parts:
        used = cache.faces[slice(*part.faces)]
        assert part.vertices[0] <= used.min()
        assert used.max() < part.vertices[1]
        assert of.skeleton.names[part.node] or part.name
    assert len({part.material for part in cache.parts}) > 1


def test_nodes_depth_first() -> None:
    """Two meshes: the one that stands later in the file but earlier in the tree comes first."""
    triangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    content = buffered(("VEC3", 5126, triangle))
    content |= {
        "scenes": [{"nodes": [2, 0]}],
        "nodes": [{"mesh": 0, "name": "last"}, {"mesh": 0, "name": "first"}, {"children": [1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 0}, "mode": 6}]}],
    }
    cache = bake(reader.scene(opened(text(content))), Clip("", ()), times=np.zeros(1), rigid=True)
    assert [part.name for part in cache.parts] == ["first", "first", "last", "last"]
    assert [part.vertices for part in cache.parts] == [(0, 3), (3, 6), (6, 9), (9, 12)]
    assert cache.faces.tolist() == [[0, 1, 2], [4, 5, 3], [6, 7, 8], [10, 11, 9]]


@pytest.mark.parametrize("method", SKINNING_METHODS)
def test_mesh_space_is_the_node_away_from_world_space(method: str) -> None:
    of = random_scene(3, scale_shear=0.2)
    played = moving(of, 4)
    node = of.instances[0].node
    turning = track("rotation", [0, 2], about("z", [10, 100]), node=node)
    growing = track("scale", [0, 2], np.array([[1, 1, 1], [2, 3, 0.5]]), node=node)
    played = replace(played, tracks=(*played.tracks, turning, growing))
    of = Scene(of.skeleton, (replace(of.instances[0], mesh=replace(of.instances[0].mesh, normals=_normals(of))),))
    worldly = bake(of, played, times=TIMES, method=method, normals=True).load_all()
    own = bake(of, played, times=TIMES, method=method, normals=True, space="mesh").load_all()
    at = world_matrices(of.skeleton, sample_pose(of.skeleton, played, TIMES))[:, node]
    back = matrix.apply(at, own.positions.astype(float))
    assert np.abs(back - worldly.positions).max() < 1e-5 * np.abs(back).max()
    assert own.normals is not None
    assert worldly.normals is not None
    turned = own.normals @ np.linalg.inv(at[..., :3])
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
    assert np.abs(turned - worldly.normals).max() < 1e-4


@pytest.mark.parametrize("method", SKINNING_METHODS)
def test_normals_of_one_joint_stand_on_the_moved_surface(method: str) -> None:
    """Of a slanted triangle under a joint that turns, stretches and mirrors: n′ is the moved face's own, outside."""
    points = np.array([[0, 0, 0], [1, 0, 0.2], [0, 1, 0.5]])
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    normal /= np.linalg.norm(normal)
    for scale in ([1, 1, 1], [2, 0.5, 3], [-1, 1, 1], [-2, 0.5, 1]):
        body = mesh(points, [[0, 1]] * 3, [[1, 0]] * 3, faces=TRIANGLE, normals=np.tile(normal, (3, 1)))
        of = scene(body, [-1, 0], scale=[scale, [1, 1, 1]], rotation=about("x", [35, 0]).tolist())
        chunk = bake(of, clip(), times=np.zeros(1), method=method, normals=True).load_all()
        a, b, c = chunk.positions[0].astype(float)
        wanted = np.cross(b - a, c - a) * np.sign(np.prod(scale))
        assert chunk.normals is not None
        assert chunk.normals[0] == pytest.approx(np.tile(wanted / np.linalg.norm(wanted), (3, 1)), abs=1e-5)


def test_normals_morph_and_come_from_faces_where_there_are_none() -> None:
    flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    up = np.tile([0.0, 0, 1], (3, 1))
    lift = np.array([[[0, 0, 0], [0, 0, 0], [0, 0, 1.0]]])
    lean = np.tile([[0.0, -1, 0]], (1, 3, 1))
    morphing = clip(track("weights", [0, 1], [[0], [1]], node=1))
    for normals, targets in ((up, lean), (None, None)):
        body = mesh(flat, [[0]] * 3, [[1]] * 3, faces=TRIANGLE, targets=lift, normals=normals, normal_targets=targets)
        chunk = bake(scene(body, [-1]), morphing, times=np.array([0.0, 1.0]), normals=True).load_all()
        assert chunk.normals is not None
        assert chunk.positions[1, 2].tolist() == [0, 1, 1]
        half = np.sqrt(0.5)
        assert chunk.normals[0] == pytest.approx(up)
        assert chunk.normals[1] == pytest.approx(np.tile([0, -half, half], (3, 1)), abs=1e-6)


def test_blend_goes_from_lbs_to_the_method() -> None:
    of = random_scene(2)
    of = Scene(of.skeleton, (replace(of.instances[0], mesh=replace(of.instances[0].mesh, normals=_normals(of))),))
    played = moving(of, 3)

    def baked(**how: object) -> tuple[np.ndarray, np.ndarray]:
        chunk = bake(of, played, times=TIMES, normals=True, **how).load_all()  # type: ignore[arg-type]
        assert chunk.normals is not None
        return chunk.positions, chunk.normals

    linear, dual = baked(), baked(method="dqs")
    for i in range(2):
        assert np.array_equal(baked(method="dqs", blend=0.0)[i], linear[i]) or i
        assert np.abs(baked(method="dqs", blend=0.0)[i] - linear[i]).max() < 1e-6
        assert np.abs(baked(method="dqs", blend=1.0)[i] - dual[i]).max() < 1e-6
    assert np.abs(baked(method="dqs", blend=0.25)[0] - (0.75 * linear[0] + 0.25 * dual[0])).max() < 1e-5


@pytest.mark.parametrize("method", SKINNING_METHODS)
def test_same_bytes_for_any_chunk_and_number_of_threads(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    of = random_scene(7, scale_shear=0.3)
    played = moving(of, 3)
    once = bake(of, played, times=TIMES, method=method, threads=1).load_all().positions
    monkeypatch.setattr(chunk_pipeline, "MIN_VERTICES", 7)
    assert np.array_equal(once, bake(of, played, times=TIMES, method=method, threads=5).load_all().positions)
    monkeypatch.setattr(chunk_pipeline, "CHUNK_BYTES", 1)
    cache = bake(of, played, times=TIMES, method=method)
    assert [(chunk.first, len(chunk.positions)) for chunk in cache.chunks()] == [(0, 32), (32, 13)]
    assert np.array_equal(cache.load_all().positions, once)
    assert np.array_equal(cache.load_all().positions, once), "a second pass is the first"
    alone = bake(of, played, times=TIMES[17:18], method=method).load_all().positions
    assert np.array_equal(alone[0], once[17]), "a frame does not depend on the others"


def test_nothing_is_computed_before_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunk_pipeline, "CHUNK_BYTES", 1)
    of = random_scene(7)
    done: list[int] = []
    made = prepare_bake(of)
    frames = made.bake(moving(of, 3), times=np.arange(10_000_000) / 1000.0, progress=done.append)
    chunks = frames.chunks()
    assert done == []
    assert len(next(chunks).positions) == 32
    next(chunks)
    assert done == [32]


def test_only_what_skins_or_morphs_is_baked_unless_rigid_is_wanted() -> None:
    of = reader.scene(opened_fixture("interpolations"))
    with pytest.raises(NotFoundError, match="no mesh with a skin or morph targets") as refused:
        bake(of, clip(), times=np.zeros(1))
    assert "`rigid`" in refused.value.help
    assert bake(of, clip(), times=np.zeros(1), rigid=True).vertex_count == of.vertex_count
    nodes = [of.instances[1].node]
    assert bake(of, clip(), times=np.zeros(1), rigid=True, nodes=nodes).vertex_count == 36


def test_rest_is_the_scene_without_a_clip() -> None:
    of = random_scene(3, scale_shear=0.4)
    cache = bake(of, moving(of, 1), times=np.zeros(1))
    still = bake(of, clip(), times=np.zeros(1)).load_all().positions[0]
    assert cache.rest is not None
    assert np.abs(cache.rest - still).max() < 1e-5


@pytest.mark.parametrize(
    ("how", "problem"),
    [
        ({"method": "lsb"}, r"`method` is 'lsb' \(expected one of lbs, dqs, cor\)"),
        ({"method": "dqs", "blend": 1.5}, r"`blend` is 1.5 \(expected 0 … 1\)"),
        ({"blend": 0.5}, "`blend` requires a method other than lbs"),
        ({"bulge_clamp": True}, "`bulge_clamp` requires a method other than lbs"),
        ({"space": "bind"}, r"`space` is 'bind' \(expected one of world, mesh\)"),
    ],
)
def test_parameters_out_of_range(how: dict[str, object], problem: str) -> None:
    with pytest.raises(RangeError, match=problem):
        bake(random_scene(1), clip(), times=np.zeros(1), **how)  # type: ignore[arg-type]


def test_influences_that_cant_be() -> None:
    body = mesh([[0, 0, 0]], [[7]], [[1]])
    with pytest.raises(RangeError, match=r"mesh 'mesh', vertex 0 uses joint 7|mesh 'mesh': vertex 0 uses joint 7"):
        bake(scene(body, [-1]), clip(), times=np.zeros(1))
    body = mesh([[0, 0, 0]], [[0]], [[np.nan]])
    with pytest.raises(RangeError, match="vertex 0 has a skin weight that is no number"):
        bake(scene(body, [-1]), clip(), times=np.zeros(1))


def test_a_flat_node_has_no_mesh_space() -> None:
    of = random_scene(1)
    flat = clip(track("scale", [0], [[1, 0, 1]], node=of.instances[0].node))
    with pytest.raises(RangeError, match="mesh space is flat"):
        bake(of, flat, times=np.zeros(1), space="mesh").load_all()


def test_files_that_cant_be_skinned() -> None:
    """Joints out of range, weights that are no numbers, no influences, Draco: refused with their place."""
    points = ("VEC3", 5126, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    joints, weights = ("VEC4", 5121, [[0, 0, 0, 0]] * 3), ("VEC4", 5126, [[1.0, 0, 0, 0]] * 3)

    def skinned(*accessors: tuple[str, int, object], **primitive: object) -> Json:
        names = ("POSITION", "JOINTS_0", "WEIGHTS_0")[: len(accessors)]
        attributes = {name: i for i, name in enumerate(names)}
        content: Json = buffered(*accessors)  # type: ignore[arg-type]
        return content | {
            "nodes": [{"mesh": 0, "skin": 0}, {}],
            "skins": [{"joints": [1]}],
            "meshes": [{"primitives": [{"attributes": attributes, **primitive}]}],
        }

    fine = reader.scene(opened(text(skinned(points, joints, weights))))
    assert bake(fine, clip(), times=np.zeros(1)).vertex_count == 3
    with pytest.raises(FormatError, match="uses joint 9"):
        reader.scene(opened(text(skinned(points, ("VEC4", 5121, [[9, 0, 0, 0]] * 3), weights))))
    with pytest.raises(FormatError, match="NaN"):
        reader.scene(opened(text(skinned(points, joints, ("VEC4", 5126, [[np.nan, 0, 0, 0]] * 3)))))
    with pytest.raises(FormatError, match="no JOINTS_0"):
        reader.scene(opened(text(skinned(points))))
    draco = {"extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}}
    with pytest.raises(FormatError, match="Draco data"):
        reader.scene(opened(text(skinned(points, joints, weights, **draco))))


def test_bad_sums_are_told() -> None:
    body = mesh([[0, 0, 0]] * 4, [[0]] * 4, [[1]] * 4, weight_sums=np.array([1, 0.9, 1.25, 0]))
    of = scene(body, [-1])
    (bad,) = unnormalized_weights([*of.instances, *of.instances])
    assert (bad.mesh, bad.count, bad.none, bad.least, bad.most) == ("mesh", 3, 1, 0.9, 1.25)
    assert unnormalized_weights(random_scene(1).instances) == []


def test_a_mesh_on_two_nodes_is_baked_twice() -> None:
    body = mesh([[1, 0, 0]], [[0]], [[1]], targets=[[[0, 1, 0]]])
    plain = replace(body, joints=np.empty((1, 0), np.int64), weights=np.empty((1, 0)))
    nodes = skeleton([-1, -1], translation=[[0, 0, 0], [5, 0, 0]])
    of = Scene(nodes, (MeshInstance(0, plain, None, np.array([0.0])), MeshInstance(1, plain, None, np.array([0.5]))))
    found = bake(of, clip(), times=np.zeros(1)).load_all().positions[0]
    assert found.tolist() == [[1, 0, 0], [6, 0.5, 0]]


@pytest.mark.skipif(not ASSETS.is_dir(), reason="shared/assets is not there")
@pytest.mark.parametrize("method", SKINNING_METHODS)
def test_real_files_stay_whole(method: str) -> None:
    """No vertex of the walking man leaves the box of his bind pose by more than a stride."""
    document = opened_path(ASSETS / "CesiumMan.glb")
    of, (walk,) = reader.scene(document), reader.clips(document)
    found = bake(of, walk, times=np.linspace(walk.start, walk.end, 20), method=method).load_all().positions
    rest = of.instances[0].mesh.positions
    assert np.isfinite(found).all()
    assert np.ptp(found.reshape(-1, 3), axis=0).max() < 1.3 * np.ptp(rest, axis=0).max()


def _normals(of: Scene) -> np.ndarray:
    normals = np.random.default_rng(0).normal(size=of.instances[0].mesh.positions.shape)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
