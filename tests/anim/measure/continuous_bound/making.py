"""Pairs of clips by chance, and how far apart they are by plain loops over times and vertices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.measure.error.surface import place_points, surfaces
from anim.model import Clip, Interpolation, Scene, Track
from anim.sampling import world_matrices
from anim.sampling.players import sampler_for
from tests.anim.skinning.scenes import random_scene
from tests.clips import CUBICSPLINE, LINEAR, STEP, clip, track

ALL = ("spec", "three", "raw", "nlerp")
MODES = (STEP, LINEAR, LINEAR, LINEAR, CUBICSPLINE)
JOINTS = 5


def pair(
    seed: int, *, modes: Sequence[Interpolation] = MODES, wild: Sequence[float] = (0.05, 0.3, 1.0)
) -> tuple[Scene, Clip, Clip]:
    """A skinned tree, morphed or not, a clip of it, and a version of that clip with other keys and other values.

    wild: how far keys are apart, one of these; keys may be a few ms from each other.
    """
    random = np.random.default_rng(seed)
    morphs = {"targets": 0.3 * random.normal(size=(2, 30, 3)), "rest_weights": [0.1, 0.0]} if seed % 3 == 0 else {}
    scene = random_scene(seed, joints=JOINTS, vertices=30, scale_shear=0.2 * (seed % 2), **morphs)
    axes = [np.unique(np.concatenate(([0.0], random.random(random.integers(1, 8)), [1.0]))) for _ in range(2)]
    distance = float(random.choice(wild))
    chances = {"rotation": 0.9, "translation": 0.4, "scale": 0.2}
    tracks = [
        _track(random, path, node, axes[random.integers(2)], distance, modes)
        for node in range(JOINTS)
        for path, chance in chances.items()
        if random.random() < chance
    ]
    if morphs:
        tracks.append(_track(random, "weights", JOINTS, axes[0], distance, modes))
    tracks = tracks or [_track(random, "rotation", 0, axes[0], distance, modes)]
    off = float(random.choice([0, 1e-5, 1e-3, 1e-1]))
    return scene, clip(*tracks), clip(*(_changed(random, each, off) for each in tracks[random.integers(2) :] or tracks))


def proven(scene: Scene, before: Clip, after: Clip, *, players: Sequence[str] = ALL, **more: float) -> Proof:
    """What is certified of a pair of clips, looked at where `optimize` looks."""
    ruler = ErrorMetric(scene)
    times = dense_times(before, after)
    look = ruler.sample_errors(before, after, times, players=players)
    return Prover(ruler).certified(before, after, times, look, **more)


def apart(scene: Scene, before: Clip, after: Clip, times: Floats, player: str) -> float:
    """The largest distance of any vertex at some times, vertex by vertex, without any bound."""
    poses = [sampler_for(scene.skeleton, each, player=player).at(times) for each in (before, after)]
    worlds = [world_matrices(scene.skeleton, each) for each in poses]
    worst = 0.0
    for surface in surfaces(scene):
        for f in range(len(times)):
            points = []
            for pose, world in zip(poses, worlds, strict=True):
                weights = pose.weights.get(surface.owner)
                points.append(
                    place_points(
                        surface, world[f, surface.nodes], surface.rest_weights if weights is None else weights[f]
                    )
                )
            worst = max(worst, float(np.linalg.norm(points[1] - points[0], axis=1).max()))
    return worst


def between(times: Floats, count: int, seed: int = 0) -> Floats:
    """Times by chance between each two neighbors, `count` of them, and the last moments before each."""
    random = np.random.default_rng(seed)
    inside = [times[:-1] + random.random(len(times) - 1) * np.diff(times) for _ in range(count)]
    return np.unique(np.concatenate([*inside, np.nextafter(times[1:], 0)]))


def _track(
    random: np.random.Generator, path: str, node: int, times: Floats, wild: float, modes: Sequence[Interpolation]
) -> Track:
    mode = modes[int(random.integers(len(modes)))]
    width = {"rotation": 4, "weights": 2}.get(path, 3)
    values = wild * random.normal(size=(len(times), width))
    if path == "rotation":
        values = random.normal(size=4) + np.cumsum(values, axis=0)
        values *= random.choice([-1.0, 1.0], size=(len(times), 1)) / np.linalg.norm(values, axis=1, keepdims=True)
    elif path == "scale":
        values = 1 + 0.3 * values
    if mode is not CUBICSPLINE and random.random() < 0.2:
        values = np.repeat(values[:1], len(times), axis=0)
    sides = wild * random.normal(size=values.shape), wild * random.normal(size=values.shape)
    return track(path, times, values, mode, node=node, tangents=sides if mode is CUBICSPLINE else None)


def _changed(random: np.random.Generator, of: Track, off: float) -> Track:
    """A track with some keys missing and others moved; rotations of some are no longer of unit length."""
    keep = np.ones(len(of.times), np.bool_)
    if random.random() < 0.5:
        keep[1:-1] = random.random(len(of.times) - 2) < 0.7
    values = of.values[keep] + off * random.normal(size=of.values[keep].shape)
    if of.path == "rotation" and random.random() < 0.5:
        values *= (1 + 3e-5 * random.normal(size=(len(values), 1))) / np.linalg.norm(values, axis=1, keepdims=True)
    sides = (None if each is None else each[keep] for each in (of.in_tangents, of.out_tangents))
    arriving, leaving = sides
    return of.with_keys(of.times[keep], values, arriving, leaving)
