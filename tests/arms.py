"""A file of many arms, and a clip for each that moves few nodes: of every kind of node, mesh and track."""

from __future__ import annotations

import json
from typing import Any, TypeAlias

import numpy as np

from fixtures.broken.pieces import buffered, glb
from tests.many import CORNERS, JOINTS, MATRICES, MESH, ROTATIONS, SKINNED, TIMES, WEIGHTS

Json: TypeAlias = dict[str, Any]

NUM_KEYS = 13
SHEARED = [1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0.3, 1, 0, 0, 0.05, 0, 1]
MODES = ("LINEAR", "STEP", "CUBICSPLINE")
FIRST = 9  # accessor of the first clip; before it those of `many`, two morph targets and the key times


def arms(count: int) -> bytes:
    """Arms of four nodes beside each other, the last two without a name, and a clip for each.

    Of each four arms two have a mesh, every fifth one with morph targets, and one has a skin that shares a joint with
    the next arm. Every third arm has a sheared node. Every fifth clip closes as a loop, and moves morph weights.
    """
    nodes = [node for i in range(count) for node in _arm(i)]
    skinned = range(3, count, 4)
    nodes += [{"name": f"skin{i}", "mesh": 1, "skin": k} for k, i in enumerate(skinned)]
    skins = [{"joints": [4 * i, 4 * ((i + 1) % count) + 1], "inverseBindMatrices": 3} for i in skinned]
    random = np.random.default_rng(count)
    outputs: list[tuple[str, int, Any]] = []
    animations = [_clip(i, outputs, random) for i in range(count)]
    targets = [("VEC3", 5126, 0.1 * random.normal(size=(3, 3))) for _ in range(2)]
    times = ("SCALAR", 5126, np.arange(NUM_KEYS) / (NUM_KEYS - 1))
    arrays = buffered(TIMES, ROTATIONS, CORNERS, MATRICES, JOINTS, WEIGHTS, *targets, times, *outputs)
    morphing = {**MESH["primitives"][0], "targets": [{"POSITION": 6}, {"POSITION": 7}]}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [*range(0, 4 * count, 4), *range(4 * count, len(nodes))]}],
        "nodes": nodes,
        "skins": skins,
        "meshes": [MESH, {"primitives": [SKINNED]}, {"primitives": [morphing], "weights": [0.2, 0]}],
        "animations": animations,
        **arrays,
    }
    return glb(json.dumps(document).encode())


def _arm(i: int) -> list[Json]:
    carried = {"mesh": 0} if i % 4 in (0, 1) else {}
    return [
        {"name": f"arm{i}", "translation": _place(i), "children": [4 * i + 1]},
        {"name": f"hand{i}", "translation": [0, 0.1, 0], "children": [4 * i + 2, 4 * i + 3], **carried},
        {"matrix": SHEARED} if i % 3 == 0 else {"translation": [0, 0.05, 0], "scale": [1, 1.5, 1]},
        {"translation": [0.05, 0, 0], **({"mesh": 2} if i % 5 == 0 else carried)},
    ]


def _place(i: int) -> list[float]:
    return [0.3 * (i % 8), 0, 0.3 * (i // 8)]


def _clip(i: int, outputs: list[tuple[str, int, Any]], random: np.random.Generator) -> Json:
    """The clip of an arm. outputs: of all clips so far, added to."""
    times = np.arange(NUM_KEYS) / (NUM_KEYS - 1)
    angles = 0.3 * random.normal() * np.sin(2 * np.pi * times) + (0 if i % 5 == 0 else 0.2) * times**2
    turned = np.array([np.zeros(NUM_KEYS), np.zeros(NUM_KEYS), np.sin(angles / 2), np.cos(angles / 2)]).T
    mode = MODES[i % 3]
    if mode == "CUBICSPLINE":
        slopes = np.gradient(turned, times, axis=0)
        turned = np.stack((slopes, turned, slopes), axis=1).reshape(-1, 4)
    moved = np.array(_place(i)) + np.outer(0.01 * (i % 3) * times, [1, 0, 0])
    tracks = [(4 * i + 1, "rotation", mode, "VEC4", turned), (4 * i, "translation", "LINEAR", "VEC3", moved)]
    if i % 5 == 0:
        weights = np.outer(np.sin(2 * np.pi * times), [0.5, -0.2]).ravel()
        tracks.append((4 * i + 3, "weights", "LINEAR", "SCALAR", weights))
    samplers: list[Json] = []
    channels: list[Json] = []
    for node, path, interpolation, kind, values in tracks:
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": FIRST - 1, "output": FIRST + len(outputs), "interpolation": interpolation})
        outputs.append((kind, 5126, values))
    return {"name": f"c{i}", "samplers": samplers, "channels": channels}
