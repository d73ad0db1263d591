"""A file of glTF, USD or Alembic in Blender, frame by frame: run by a Python that has `bpy`. See tests/blender.py.

    python blender_play.py FILE TASK OUT

TASK is JSON {"clip": name or None, "times": seconds, "fps": of the scene}, OUT an .npz with an array (F, V, 3) per
object that has vertices: world space, meters, Y up as in glTF, in Blender's own order of vertices. OUT.json has the
texture coordinates of each of these objects, and the images that give its base color.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np


def main(file: str, task: str, out: str) -> None:
    """Import FILE, play the clip, and write the vertices at all times to OUT."""
    told = json.loads(task)
    fps = told["fps"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = fps, 1.0
    if file.endswith(".abc"):
        bpy.ops.wm.alembic_import(filepath=file, as_background_job=False)
    elif ".usd" in file:
        bpy.ops.wm.usd_import(filepath=file)
    else:
        bpy.ops.import_scene.gltf(filepath=file, merge_vertices=False, disable_bone_shape=True)
    if told["clip"] is not None:
        _choose(told["clip"])
    found: dict[str, list[Any]] = {each.name: [] for each in _meshes(scene)}
    for time in told["times"]:
        frame = time * fps
        scene.frame_set(int(frame // 1), subframe=frame % 1)
        graph = bpy.context.evaluated_depsgraph_get()
        for each in _meshes(scene):
            found[each.name].append(_vertices(each.evaluated_get(graph)))
    arrays: dict[str, Any] = {name: np.array(frames) for name, frames in found.items()}
    np.savez(out, **arrays)
    with open(f"{out}.json", "w") as target:
        json.dump({each.name: _looks(each) for each in _meshes(scene)}, target)


def _choose(clip: str) -> None:
    """Let everything play the action of a clip: the importer keeps each in a muted track of the clip's name."""
    for owner in (*bpy.data.objects, *bpy.data.shape_keys):
        data = owner.animation_data
        if data is None:
            continue
        data.action = None
        for track in data.nla_tracks:
            if track.name == clip and track.strips:
                data.action = track.strips[0].action
                data.action_slot = track.strips[0].action_slot


def _looks(placed: Any) -> dict[str, Any]:
    """Names of the texture coordinates, and width and height of the image behind each material's base color."""
    images = []
    for slot in placed.material_slots:
        for link in slot.material.node_tree.links if slot.material else ():
            if link.to_socket.name == "Base Color" and link.from_node.type == "TEX_IMAGE":
                images.append(tuple(link.from_node.image.size))
    return {"coordinates": [each.name for each in placed.data.uv_layers], "images": images}


def _meshes(scene: Any) -> Iterator[Any]:
    return (each for each in scene.objects if each.type == "MESH")


def _vertices(placed: Any) -> Any:
    """World positions (V, 3), Y up, of an object with its shape keys and armature applied."""
    mesh = placed.to_mesh()
    own = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", own)
    placed.to_mesh_clear()
    matrix = np.array(placed.matrix_world, np.float64)
    world = own.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.stack((world[:, 0], world[:, 2], -world[:, 1]), axis=1)


if __name__ == "__main__":
    main(*sys.argv[1:])
