"""What a prompt shows of a value: one short line, and no arrays."""

from __future__ import annotations

import numpy as np

import anim
import fixtures
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.sampling.pose import sample_pose
from anim.sampling.sample import sample
from anim.skinning.bake import bake

MAX_WIDTH = 120


def test_of_edited_json_what_is_no_array_has_no_length() -> None:
    asset = anim.load(fixtures.build("biped"))
    asset.document.json["nodes"] = None
    assert repr(asset) == "Asset('bytes', animations=3, nodes=?, meshes=1)"
    assert "nodes=?" in repr(asset.document)
    assert "nodes: is null" in asset._repr_html_()


def test_each_value_is_one_short_line() -> None:
    document = container.read(fixtures.build("biped"))
    clip, skeleton, scene = reader.clips(document)[0], reader.skeleton(document), reader.scene(document)
    instance, times = scene.instances[0], np.linspace(0, 1, 200)
    cache = bake(scene, clip, times=times[:2])
    assert repr(clip) == "Clip('walk', tracks=22, start_s=0, end_s=1)"
    assert repr(clip.tracks[0]) == "Track(node=0, translation, LINEAR, keys=25, start_s=0, end_s=1)"
    assert repr(skeleton) == "Skeleton(nodes=22, roots=2, first='hips')"
    assert repr(scene) == "Scene(nodes=22, instances=1, vertices=3818)"
    assert repr(cache) == "VertexCache(frames=2, vertices=3818, faces=7540, start_s=0, end_s=0.5)".replace(
        "0.5", f"{times[1]:.6g}"
    )
    values = [document, clip, clip.tracks[0], skeleton, scene, instance, instance.mesh, instance.skin, cache]
    values += [next(cache.chunks()), sample_pose(skeleton, clip, times), sample(skeleton, clip, times)]
    for value in values:
        assert "\n" not in repr(value)
        assert "array(" not in repr(value)
        assert len(repr(value)) <= MAX_WIDTH
