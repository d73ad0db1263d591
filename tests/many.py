"""Files of many items of one kind: small, valid, and what an attacker or a generator would make."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from fixtures.broken.pieces import buffered, glb

Json = dict[str, Any]
Make: TypeAlias = Callable[[int], bytes]

HALF = 0.7071068
TIMES = ("SCALAR", 5126, [0, 0.5, 1])
ROTATIONS = ("VEC4", 5126, np.array([[0, 0, 0, 1], [0, 0, HALF, HALF], [0, 0, 0, 1]]))
CORNERS = ("VEC3", 5126, np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]))
MATRICES = ("MAT4", 5126, np.array([np.eye(4).ravel()] * 2))
JOINTS = ("VEC4", 5123, np.array([[0, 1, 0, 0]] * 3))
WEIGHTS = ("VEC4", 5126, np.array([[0.5, 0.5, 0, 0]] * 3))
SKINNED = {"attributes": {"POSITION": 2, "JOINTS_0": 4, "WEIGHTS_0": 5}}
MESH = {"primitives": [{"attributes": {"POSITION": 2}}]}


def _file(nodes: list[Json], **parts: Any) -> bytes:
    """A .glb of nodes, by default with accessors of times, rotations, corners, matrices, joints and weights."""
    below = {child for node in nodes for child in node.get("children", ())}
    roots = [i for i in range(len(nodes)) if i not in below]
    arrays = buffered(TIMES, ROTATIONS, CORNERS, MATRICES, JOINTS, WEIGHTS, *parts.pop("more", ()))
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes, **arrays}
    return glb(json.dumps({**document, **parts}, separators=(",", ":")).encode())


def _clip(nodes: list[int], name: str = "a", output: int = 1) -> Json:
    channels = [{"sampler": 0, "target": {"node": node, "path": "rotation"}} for node in nodes]
    return {"name": name, "samplers": [{"input": 0, "output": output}], "channels": channels}


def chain_bare(count: int) -> bytes:
    """Nodes one below the other without a name or place, the first one animated: as many as fit into a file."""
    nodes: list[Json] = [{"children": [i + 1]} for i in range(count - 1)]
    return _file([*nodes, {}], animations=[_clip([0])])


def _line(count: int) -> list[Json]:
    nodes: list[Json] = [{"name": f"n{i}", "translation": [0, 1e-3, 0], "children": [i + 1]} for i in range(count)]
    del nodes[-1]["children"]
    return nodes


def chain(count: int) -> bytes:
    """Nodes one below the other, the first one animated."""
    return _file(_line(count), animations=[_clip([0])])


def chain_mesh(count: int) -> bytes:
    """The same with a mesh at the end."""
    nodes = _line(count)
    nodes[-1]["mesh"] = 0
    return _file(nodes, animations=[_clip([0])], meshes=[MESH])


def chain_open(count: int) -> bytes:
    """Nodes one below the other, all animated."""
    return _file(_line(count), animations=[_clip(list(range(count)))])


def side(count: int) -> bytes:
    """Nodes beside each other, the first one animated."""
    return _file([{"name": f"n{i}"} for i in range(count)], animations=[_clip([0])])


def side_meshes(count: int) -> bytes:
    """Nodes beside each other with a mesh each, the first one animated."""
    nodes = [{"name": f"n{i}", "mesh": i, "translation": [1e-3 * i, 0, 0]} for i in range(count)]
    return _file(nodes, animations=[_clip([0])], meshes=[MESH] * count)


def side_moving(count: int) -> bytes:
    """Nodes beside each other, all animated."""
    return _file([{"name": f"n{i}"} for i in range(count)], animations=[_clip(list(range(count)))])


def skins(count: int) -> bytes:
    """Skins of two joints, each with a mesh of its own."""
    joints: list[Json] = [{"name": "root", "children": [1]}, {"name": "end", "translation": [0, 0.1, 0]}]
    nodes = [*joints, *({"name": f"m{i}", "mesh": i, "skin": i} for i in range(count))]
    skin = {"joints": [0, 1], "inverseBindMatrices": 3}
    parts: Json = {"skins": [skin] * count, "meshes": [{"primitives": [SKINNED]}] * count}
    return _file(nodes, animations=[_clip([1])], **parts)


def skins_different(count: int) -> bytes:
    """The same, each with an inverse bind matrix of its own."""
    matrices = np.tile(np.eye(4).ravel(), (count, 2, 1))
    matrices[:, 1, 13] = -np.linspace(0.1, 0.2, count)  # translation along y
    more = [("MAT4", 5126, each) for each in matrices]
    document = json.loads(skins(count)[20:])
    document |= buffered(TIMES, ROTATIONS, CORNERS, MATRICES, JOINTS, WEIGHTS, *more)
    document["skins"] = [{"joints": [0, 1], "inverseBindMatrices": 6 + i} for i in range(count)]
    return glb(json.dumps(document).encode())


def joints(count: int) -> bytes:
    """One skin of many joints in one line, the first one animated."""
    nodes = [*_line(count), {"name": "m", "mesh": 0, "skin": 0}]
    parts: Json = {"skins": [{"joints": list(range(count))}], "meshes": [{"primitives": [SKINNED]}]}
    return _file(nodes, animations=[_clip([0])], **parts)


def clips_equal(count: int) -> bytes:
    """Clips of the same keys."""
    return _file([{"name": "n", "mesh": 0}], animations=[_clip([0], f"c{i}") for i in range(count)], meshes=[MESH])


def clips_different(count: int) -> bytes:
    """Clips of other keys each."""
    angles = np.linspace(0.1, 3, 3 * count)
    values = np.stack([0 * angles, 0 * angles, np.sin(angles), np.cos(angles)], axis=-1)
    document = json.loads(_file([{"name": "n", "mesh": 0}], more=[("VEC4", 5126, values)], meshes=[MESH])[20:])
    parts = {"bufferView": 6, "componentType": 5126, "count": 3, "type": "VEC4"}
    document["accessors"] += [{**parts, "byteOffset": 48 * i} for i in range(count)]
    document["animations"] = [_clip([0], f"c{i}", 7 + i) for i in range(count)]
    return glb(json.dumps(document).encode())


def clips_empty(count: int) -> bytes:
    """Clips without channels."""
    return _file([{"name": "n"}], animations=[{"name": f"c{i}", "samplers": [], "channels": []} for i in range(count)])


def channels(count: int) -> bytes:
    """Clips of ten nodes, so that there are so many channels in all."""
    nodes = [{"name": f"n{i}", "mesh": 0} for i in range(10)]
    return _file(nodes, animations=[_clip(list(range(10)), f"c{i}") for i in range(count // 10)], meshes=[MESH])


def keys(count: int) -> bytes:
    """One channel of so many keys."""
    times, angles = np.arange(count) / 30, np.arange(count) / 10
    values = np.stack([0 * angles, 0 * angles, np.sin(angles), np.cos(angles)], axis=-1)
    document = json.loads(
        _file([{"name": "n", "mesh": 0}], more=[("SCALAR", 5126, times), ("VEC4", 5126, values)], meshes=[MESH])[20:]
    )
    document["animations"] = [{**_clip([0], output=7), "samplers": [{"input": 6, "output": 7}]}]
    return glb(json.dumps(document).encode())


def targets(count: int) -> bytes:
    """Morph targets of one mesh, animated."""
    weights = np.zeros((3, count))
    weights[1] = 1 / count
    mesh = {"primitives": [{**MESH["primitives"][0], "targets": [{"POSITION": 2}] * count}], "weights": [0] * count}
    document = json.loads(_file([{"mesh": 0}], more=[("SCALAR", 5126, weights.ravel())], meshes=[mesh])[20:])
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    document["animations"] = [{"name": "a", "samplers": [{"input": 0, "output": 6}], "channels": [channel]}]
    return glb(json.dumps(document).encode())


def primitives(count: int) -> bytes:
    """Primitives of one mesh, each with a material of its own."""
    parts = [{**MESH["primitives"][0], "material": i} for i in range(count)]
    materials = [{"name": f"m{i}"} for i in range(count)]
    return _file([{"mesh": 0}], animations=[_clip([0])], meshes=[{"primitives": parts}], materials=materials)


def primitives_equal(count: int) -> bytes:
    """Primitives of one mesh on the same accessors."""
    parts = [{**MESH["primitives"][0], "indices": 6}] * count
    more = [("SCALAR", 5123, [0, 1, 2])]
    return _file([{"mesh": 0}], animations=[_clip([0])], meshes=[{"primitives": parts}], more=more)


def lists(count: int) -> bytes:
    """Accessors, buffer views, images, textures, materials, cameras and scenes that nothing uses."""
    document = json.loads(_file([{"name": "n", "mesh": 0}], animations=[_clip([0])], meshes=[MESH])[20:])
    document["accessors"] += [{"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3"}] * count
    document["bufferViews"] += [document["bufferViews"][0]] * count
    document["images"] = [{"bufferView": 0, "mimeType": "image/png"}] * count
    document["textures"] = [{"source": i} for i in range(count)]
    document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}} for i in range(count)]
    document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}] * count
    document["scenes"] += [{"nodes": [0]}] * count
    return glb(json.dumps(document).encode())


def names(count: int) -> bytes:
    """Names of 100 letters for each item, on few nodes; extras of as many values."""
    nodes = [{"name": f"{i}" + "n" * 10 * count, "mesh": 0} for i in range(10)]
    extras = {"list": [{"key": i} for i in range(count)]}
    return _file(nodes, animations=[_clip([0], "c" * 10 * count)], meshes=[{**MESH, "extras": extras}], extras=extras)


def springs(count: int) -> bytes:
    """VRM spring chains of two joints, beside each other, with a collider each."""
    hips = [
        {"name": f"a{i}", "children": [2 * i + 1]} if k == 0 else {"name": f"b{i}", "translation": [0, 0.1, 0]}
        for i in range(count // 2)
        for k in range(2)
    ]
    extension = {
        "specVersion": "1.0",
        "colliders": [
            {"node": 0, "shape": {"sphere": {"radius": 0.01, "offset": [0, -1 - i, 0]}}} for i in range(count)
        ],
        "springs": [{"name": f"s{i}", "joints": [{"node": 2 * i}, {"node": 2 * i + 1}]} for i in range(count // 2)],
    }
    return _file(
        hips, animations=[_clip([0])], extensionsUsed=["VRMC_springBone"], extensions={"VRMC_springBone": extension}
    )


def spring_line(count: int) -> bytes:
    """One VRM spring chain of so many joints."""
    spring = {"name": "s", "joints": [{"node": i} for i in range(count)]}
    extension = {"specVersion": "1.0", "springs": [spring]}
    return _file(
        _line(count),
        animations=[_clip([0])],
        extensionsUsed=["VRMC_springBone"],
        extensions={"VRMC_springBone": extension},
    )


def bodies(count: int) -> bytes:
    """Rigid bodies of KHR_physics_rigid_bodies far from each other."""
    about = {"KHR_physics_rigid_bodies": {"motion": {}, "collider": {"geometry": {"shape": 0}}}}
    nodes = [{"name": f"n{i}", "translation": [10 * i, 0, 0], "extensions": about} for i in range(count)]
    shape = {"type": "sphere", "sphere": {"radius": 0.1}}
    used = ["KHR_implicit_shapes", "KHR_physics_rigid_bodies"]
    return _file(nodes, extensionsUsed=used, extensions={"KHR_implicit_shapes": {"shapes": [shape]}})


def csv_columns(count: int) -> bytes:
    """Euler curves of so many columns."""
    out = io.StringIO()
    rows = csv.writer(out)
    rows.writerow(["time", *(f"n{i // 3}.r{'xyz'[i % 3]}" for i in range(count - count % 3))])
    rows.writerows([t, *([t] * (count - count % 3))] for t in (0, 1))
    return out.getvalue().encode()


def bvh_chain(count: int) -> bytes:
    """A BVH hierarchy of joints one below the other."""
    head = "".join(
        f"{'JOINT' if i else 'ROOT'} n{i}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        for i in range(count)
    )
    tail = "End Site\n{\nOFFSET 0 1 0\n}\n" + "}\n" * count
    frames = (" ".join(["0"] * 3 * count) + "\n") * 2
    return f"HIERARCHY\n{head}{tail}MOTION\nFrames: 2\nFrame Time: 0.1\n{frames}".encode()


def json_curves(count: int) -> bytes:
    """JSON curves of nodes one below the other, children first."""
    curves = {"rotation.x": {"times": [0, 1], "values": [0, 1]}}
    nodes = [{"name": f"n{i}", "parent": f"n{i - 1}" if i else None, "curves": curves} for i in range(count)]
    about = {"schema": "euler-curves/1", "order": "XYZ", "frame": "extrinsic", "unit": "deg"}
    return json.dumps({**about, "nodes": [{k: v for k, v in n.items() if v is not None} for n in nodes[::-1]]}).encode()


GLTF: Mapping[str, Make] = {
    each.__name__: each
    for each in (
        chain, chain_bare, chain_mesh, chain_open, side, side_meshes, side_moving, skins, joints, clips_equal,
        clips_different, clips_empty, channels, keys, targets, primitives, primitives_equal, lists, names,
    )
}  # fmt: skip
PHYSICS: Mapping[str, tuple[str, Make]] = {
    "springs": ("springs", springs), "spring_line": ("springs", spring_line), "bodies": ("rigid", bodies),
}  # fmt: skip
EULER: Mapping[str, tuple[str, Make]] = {
    "csv_columns": (".csv", csv_columns), "bvh_chain": (".bvh", bvh_chain), "json_curves": (".json", json_curves),
}  # fmt: skip
