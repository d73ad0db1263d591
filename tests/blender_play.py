"""A file of glTF, USD or Alembic in Blender, frame by frame: run by a Python that has `bpy`. See tests/blender.py.

    python blender_play.py FILE TASK OUT

TASK is JSON {"clip": name or None, "times": seconds, "fps": of the scene, "picture": of what}. OUT is an .npz with an
array (F, V, 3) per object that has vertices: world space, meters, Y up as in glTF, in Blender's own order of vertices.
OUT.json has the texture coordinates of each of these objects, and the images that give its base color. A picture is
None, or {"file": a .png, "time": s, "center", "size"}: a square from the front right, m, Y up, in white light.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from mathutils import Vector  # comes with bpy

PIXELS, SAMPLES = 160, 16  # of a picture: width, and rays for each of its pixels


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
    if told["picture"] is not None:
        _draw(scene, fps, **told["picture"])
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
        for node in slot.material.node_tree.nodes if slot.material else ():
            if node.type == "BSDF_PRINCIPLED":
                images += [tuple(each.size) for each in _images(node.inputs["Base Color"])]
    return {"coordinates": [each.name for each in placed.data.uv_layers], "images": images}


def _images(socket: Any) -> Iterator[Any]:
    """Images behind a socket, through factors."""
    for link in socket.links:
        if link.from_node.type == "TEX_IMAGE":
            yield link.from_node.image
        elif link.from_node.type in ("MIX", "VECT_MATH"):
            for each in link.from_node.inputs:
                yield from _images(each)


def _draw(scene: Any, fps: int, *, file: str, time: float, center: list[float], size: float) -> None:
    """Write a picture of the scene at a time."""
    frame = time * fps
    scene.frame_set(int(frame // 1), subframe=frame % 1)
    scene.world = bpy.data.worlds.new("white")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale, camera.clip_start, camera.clip_end = "ORTHO", 1.2 * size, 0.01 * size, 9 * size
    holder = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(holder)
    scene.camera = holder
    back = Vector((0.5, -0.8, 0.35)).normalized()
    holder.location = Vector((center[0], -center[2], center[1])) + 4 * size * back
    holder.rotation_euler = (-back).to_track_quat("-Z", "Y").to_euler()
    render = scene.render
    render.engine, scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CYCLES", "CPU", SAMPLES, 0
    scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = False, False
    scene.view_settings.view_transform = "Standard"
    render.resolution_x = render.resolution_y = PIXELS
    render.filepath, render.image_settings.file_format = file, "PNG"
    bpy.ops.render.render(write_still=True)


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
