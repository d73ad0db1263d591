"""Rebase of the rest pose onto the most common constants, so that clips can drop those channels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.node_constraints import rest_pose_extensions
from anim.model import Clip, Scene, Skeleton
from anim.optimization.search.source_motion import PATHS

EQUAL_TOLERANCE = 2e-4  # in units of the value: constants this close count as equal
CONSTANT_TOLERANCE = 1e-4  # in units of the value: a track this close to its first value is constant
MIN_REST_CHANGE = 1e-5  # in units of the value: a smaller difference leaves the rest value


@dataclass(frozen=True, slots=True)
class RebasedDocument:
    """A scene and its document in a new rest pose. moved: (node, path) of every changed rest value."""

    document: Document
    scene: Scene
    moved: tuple[tuple[int, str], ...]


def rebase(document: Document, scene: Scene, clips: Sequence[Clip], *, exact: bool = False) -> RebasedDocument:
    """Return the scene with the most common constant of each property as its rest value.

    Only properties that every clip animates change; the rest value of others is visible in some clip. Values are the
    shortest decimals that are equal in float32; exact: in float64 too. Nothing changes in a file with one of the
    `rest_pose_extensions`.
    """
    if rest_pose_extensions(document.json):
        return RebasedDocument(document, scene, ())
    skeleton = scene.skeleton
    values = _most_common_value(skeleton, clips)
    nodes = json_array(document.json, "nodes")
    values = {
        target: value.astype(np.float32).astype(np.float64) if exact else _short(value)
        for target, value in values.items()
        if "matrix" not in nodes[target[0]]
    }
    if not values:
        return RebasedDocument(document, scene, ())
    parts = {path: getattr(skeleton, path).copy() for path in PATHS}
    for (node, path), value in values.items():
        parts[path][node] = value
    new = replace(scene, skeleton=replace(skeleton, **parts))
    return RebasedDocument(_with_rest(document, values), new, tuple(values))


def _most_common_value(skeleton: Skeleton, clips: Sequence[Clip]) -> dict[tuple[int, str], Floats]:
    driven = Counter(track.target for clip in clips for track in clip.tracks if track.path in PATHS)
    constants: dict[tuple[int, str], list[Floats]] = {}
    for clip in clips:
        for track in clip.tracks:
            node = track.node
            if node is None or track.path not in PATHS or driven[track.target] < len(clips):
                continue
            if np.abs(track.values - track.values[0]).max() < CONSTANT_TOLERANCE:
                constants.setdefault((node, track.path), []).append(track.values[0])
    found = {}
    for (node, path), rows in constants.items():
        value = _most_common(np.array(rows), path)
        rest = getattr(skeleton, path)[node]
        if np.abs(value - rest).max() > MIN_REST_CHANGE and np.abs(value + rest).max() > MIN_REST_CHANGE * (
            path == "rotation"
        ):
            found[node, path] = value
    return found


def _most_common(rows: Floats, path: str) -> Floats:
    if path == "rotation":
        rows = rows * np.where(rows @ rows[0] < 0, -1.0, 1.0)[:, None]
        rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    near = (np.abs(rows[:, None] - rows).max(axis=2) < EQUAL_TOLERANCE).sum(axis=1)
    return np.asarray(rows[int(near.argmax())])


def _short(value: Floats) -> Floats:
    return np.array([float(str(number)) for number in value.astype(np.float32)])


def _with_rest(document: Document, values: Mapping[tuple[int, str], Floats]) -> Document:
    nodes: list[Json] = list(json_array(document.json, "nodes"))
    for (node, path), value in values.items():
        nodes[node] = {**nodes[node], path: value.tolist()}
    return replace(document, json={**document.json, "nodes": nodes})
