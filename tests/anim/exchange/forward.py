"""An independent way to read a BVH: its own tiny parser, rotation matrices, and a loop down the hierarchy."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def world_positions(text: str) -> tuple[list[str], Array]:
    """Return names (End Sites as "parent_end") and world positions (F, N, 3) in the file's unit."""
    head, _, body = text.partition("MOTION")
    words = head.replace("{", " { ").replace("}", " } ").split()
    joints: list[dict[str, Any]] = []
    stack: list[int] = []
    i = 0
    while i < len(words):
        word = words[i]
        if word in ("ROOT", "JOINT", "End"):
            parent = stack[-1] if stack else -1
            name = words[i + 1] if word != "End" else f"{joints[parent]['name']}_end"
            joints.append({"name": name, "parent": parent, "channels": []})
            stack.append(len(joints) - 1)
            i += 3
        elif word == "OFFSET":
            joints[stack[-1]]["offset"] = np.array([float(x) for x in words[i + 1 : i + 4]])
            i += 4
        elif word == "CHANNELS":
            count = int(words[i + 1])
            joints[stack[-1]]["channels"] = words[i + 2 : i + 2 + count]
            i += 2 + count
        else:
            if word == "}":
                stack.pop()
            i += 1
    numbers = re.sub(r"Frames:\s*\d+\s*Frame Time:\s*\S+", "", body).split()
    rows = np.array([float(x) for x in numbers]).reshape(-1, sum(len(j["channels"]) for j in joints))
    return [joint["name"] for joint in joints], _forward(joints, rows)


def _forward(joints: list[dict[str, Any]], rows: Array) -> Array:
    places = np.zeros((len(rows), len(joints), 3))
    for frame, row in enumerate(rows):
        at = 0
        turns: list[Array] = []
        for number, joint in enumerate(joints):
            offset, turn = joint["offset"].copy(), np.eye(3)
            for channel in joint["channels"]:
                value, axis = row[at], "XYZ".index(channel[0])
                at += 1
                if channel.endswith("position"):
                    offset[axis] = value
                else:
                    turn = turn @ _about(axis, np.radians(value))
            if joint["parent"] < 0:
                places[frame, number] = offset
                turns.append(turn)
            else:
                above = turns[joint["parent"]]
                places[frame, number] = places[frame, joint["parent"]] + above @ offset
                turns.append(above @ turn)
    return places


def _about(axis: int, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[j, j], matrix[j, k], matrix[k, j], matrix[k, k] = c, -s, s, c
    return matrix
