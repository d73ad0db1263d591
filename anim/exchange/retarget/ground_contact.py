"""Ground contact: a character's soles, and the vertical offset that keeps them on the floor."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import hierarchy, matrix
from anim.model import MeshInstance, Scene, Skeleton
from anim.model.skeleton import node_mask
from anim.sampling import rest_world

SOLE_PERCENTILE = 5.0  # percentile of a foot's lowest height, taken as its ground
MAX_CONTACT_FRACTION = 0.03  # fraction of the height; of the lowest foot above its ground during contact
NOISE_FRACTION, CLEAR_FRACTION = 0.015, 0.04  # of the height: clearance below is noise, above is none
MAX_UNEVEN_FRACTION = 0.04  # fraction of the height; of a foot's ground above the lowest ground: floors are uneven
WINDOW_S, STEP_S = 0.1, 1 / 120  # s
FEET = ("foot", "toe")  # suffixes of roles
DIRECTIONS = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])


@dataclass(frozen=True, slots=True)
class SolePoints:
    """Points fixed to foot joints: nodes (P,), points (P, 3) in the node's space.

    floor: world height at rest.
    """

    nodes: Ints
    points: Floats
    floor: float

    def heights(self, world: Floats) -> Floats:
        """Return the height (F, P) of each point under world matrices (F, N, 3, 4)."""
        mine = world[:, self.nodes]
        return np.asarray((mine[:, :, 1, :3] * self.points).sum(axis=-1) + mine[:, :, 1, 3])


def has_feet(roles: Iterable[str]) -> bool:
    """Return True for a foot or toe among roles such as "left_foot"."""
    return any(role.endswith(FEET) for role in roles)


def find_soles(scene: Scene, positions: Floats, roles: Sequence[tuple[str, int]]) -> SolePoints:
    """Return the outermost points of the skin on feet and toes, and the floor height: the lowest at rest.

    positions: (N, 3) of all nodes at rest. roles: (role, node), with a foot or toe among them (`has_feet`). Without
    skin there, the joints themselves.
    """
    world = rest_world(scene.skeleton)
    feet = {node for role, node in roles if role.endswith(FEET)}
    below = {int(node) for node in with_descendants(scene.skeleton, feet)}
    nodes, points, lowest = list[int](), list[Floats](), [float(positions[sorted(below), 1].min())]
    for instance in scene.instances:
        if instance.skin is None or not instance.mesh.joints.shape[1]:
            continue
        placed, holder = _rest_vertices(instance, world)
        lowest.append(float(placed[:, 1].min()))
        for node in sorted(below):
            mine = placed[holder == node]
            if len(mine):
                outer = mine[np.unique((mine @ DIRECTIONS.T).argmax(axis=0))]
                nodes += [node] * len(outer)
                points.append(outer)
    if not nodes:
        nodes, points = sorted(below), [positions[sorted(below)]]
    numbers = np.array(nodes, np.int64)
    return SolePoints(
        numbers, matrix.apply(matrix.inverse(world[numbers]), np.concatenate(points)[:, None])[:, 0], min(lowest)
    )


def with_descendants(skeleton: Skeleton, nodes: Collection[int]) -> Ints:
    """Return the indices of `nodes` and of all their descendants, in order."""
    return np.flatnonzero(hierarchy.with_descendants(skeleton.parents, node_mask(skeleton, nodes)))


def ground_offset(
    times: Floats, source: Floats, feet: Sequence[Ints], target: Floats, floor: float, scale: float
) -> Floats:
    """Return the excess height (F,) of the target, in metres, smooth in time.

    During contact of a source foot, the target's lowest sole must be on its floor, or as high above as the source's
    above its ground, times scale, if that exceeds the noise of recordings; during a jump, the offset is interpolated
    from take-off to landing.
    times: (F,) s. source: heights (F, N) of the source's nodes. feet: indices of the nodes of each of its feet.
    target: heights (F, P) of the target's soles; floor: of its rest pose.
    """
    height = float(np.median(np.ptp(source, axis=1))) or 1.0
    clearance = _clearance(source, feet, MAX_UNEVEN_FRACTION * height)
    down = clearance <= MAX_CONTACT_FRACTION * height
    above = target.min(axis=1) - floor - scale * clearance
    fraction = np.interp(clearance / height, (NOISE_FRACTION, CLEAR_FRACTION), (NOISE_FRACTION, 0.0))
    noise = np.minimum(clearance, height * fraction)
    return _smooth(times, np.interp(times, times[down], above[down]) + scale * noise)


def _clearance(source: Floats, feet: Sequence[Ints], uneven: float) -> Floats:
    """Clearance (F,) of the source: its lowest node above the ground, or a foot above its own ground."""
    lowest = source.min(axis=1)
    ground = float(np.percentile(lowest, SOLE_PERCENTILE))
    clearance = lowest - ground
    for foot in feet:
        own = source[:, foot].min(axis=1)
        under = float(np.percentile(own, SOLE_PERCENTILE))
        if abs(under - ground) <= uneven:
            clearance = np.minimum(clearance, own - under)
    return np.asarray(np.maximum(clearance, 0.0))


def _smooth(times: Floats, values: Floats) -> Floats:
    """Values (F,) smoothed by a Hann window of WINDOW_S, ends repeated."""
    count = int(np.ceil((times[-1] - times[0]) / STEP_S)) + 1
    if count < 3:
        return values
    half = round(WINDOW_S / STEP_S / 2)
    grid = times[0] + STEP_S * np.arange(-half, count + half)
    window = np.hanning(2 * half + 3)[1:-1]
    even = np.convolve(np.interp(grid, times, values), window / window.sum(), mode="valid")
    return np.interp(times, grid[half : half + len(even)], even)


def _rest_vertices(instance: MeshInstance, world: Floats) -> tuple[Floats, Ints]:
    """Vertices (V, 3) of a skinned mesh at rest, and the node (V,) with each one's greatest weight."""
    assert instance.skin is not None
    mesh, skin = instance.mesh, instance.skin
    moves = matrix.multiply(world[skin.joints], skin.inverse_bind)
    rows = np.einsum("vi,vijk->vjk", mesh.weights, moves[mesh.joints])
    placed = (rows[:, :, :3] @ mesh.positions[:, :, None])[:, :, 0] + rows[:, :, 3]
    most = mesh.joints[np.arange(len(placed)), mesh.weights.argmax(axis=1)]
    return placed, skin.joints[most]
