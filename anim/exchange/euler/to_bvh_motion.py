"""glTF clip → BVH motion: no rest rotation, no scale, frames on an even grid, End Sites."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import takewhile

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError, UnsupportedError
from anim.exchange.euler.curve import Curve, linear
from anim.exchange.euler.frame_error import frame_error
from anim.exchange.euler.motion import IDENTITY, ZERO, EulerMotion, EulerNode
from anim.exchange.euler.rotation_order import OrderRules
from anim.exchange.euler.to_euler import LOCK_TOLERANCE_RAD
from anim.exchange.formats.labels import label_of, labels, skipped_note, unique
from anim.maths import euler, quaternion
from anim.maths.euler import AxesConvention
from anim.model import Clip, Skeleton, TimeAxis
from anim.model.skeleton import ancestors, nearest_ancestors
from anim.sampling import rest_pose, sample_pose, world_matrices
from anim.sampling.world import world_rotations
from anim.units import format_number

GRID_TOLERANCE_FRAMES = 1e-3  # maximum deviation from an even grid, as a fraction of a frame
MAX_FRAMES = 10_000_000
TIME_ROUNDING_FRACTION = 2e-7  # relative rounding error of float32 times
NOTED_ERROR_DEG = 1.0  # degrees, of rotations between frames
CONSTANT_TOLERANCE = 1e-6  # variation of a constant offset, as a fraction of the skeleton's size
BRACES = "{}"
END_NAME_SUFFIX = "_end"  # a static leaf of this name marks the end of its parent


def to_bvh(
    skeleton: Skeleton,
    clip: Clip,
    *,
    order: str | OrderRules,
    fps: float | None = None,
    joints: Collection[int] = (),
    meters_per_unit: float = 1.0,
) -> EulerMotion:
    """Return the clip with angles relative to the rest pose, about world axes: all 0 is the rest pose.

    Every joint has its world position of the glTF at every frame: joints that move in their parent, and roots, have
    translation curves too; the notes list properties that BVH does not support. Frame k is at the clip's start + k /
    fps, the last at or after its end.
    order: one of the twelve for all joints, or `OrderRules`. fps: None for the grid of the keys. Raises RangeError for
    keys without a grid.
    joints: nodes to write, with the nodes between them; empty for all. Lengths are divided by meters_per_unit.
    """
    orders = order if isinstance(order, OrderRules) else OrderRules(euler.check_order(order))
    chosen, names = _choose_frames(skeleton, clip, joints), _names(skeleton)
    if not chosen:
        raise UnsupportedError("there is no node to write")
    orders.check([names[node] for node in chosen])
    shown, times = _frames(clip, fps)
    figure = _Skeleton(skeleton, clip, chosen, times)
    nodes = [_node(figure, node, names[node], orders, shown, meters_per_unit) for node in chosen]
    notes = (
        skipped_note(_unsupported_tracks(skeleton, clip, chosen))
        + _rename_nodes(skeleton, names, chosen)
        + _shift_start(clip)
        + _lost_between_frames(clip, times)
    )
    return EulerMotion(tuple(nodes), sampled=True, notes=notes)


JointTransform = tuple[
    Floats, Floats, Floats
]  # rest position (3,), rotation from rest (F, 4), positions (F, 3), in world space


class _Skeleton:
    """The nodes to write, in their order, with world positions at rest and at times (F,)."""

    def __init__(self, skeleton: Skeleton, clip: Clip, chosen: Sequence[int], times: Floats) -> None:
        moving, still = sample_pose(skeleton, clip, times), rest_pose(skeleton)
        self.skeleton, self.clip = skeleton, clip
        self.numbers = {node: i for i, node in enumerate(chosen)}
        self.above = nearest_ancestors(skeleton, self.numbers)
        self.ends = _ends(skeleton, clip, self.numbers)
        self._places, self._home = world_matrices(skeleton, moving)[..., 3], world_matrices(skeleton, still)[0, :, :, 3]
        turned, unturned = world_rotations(skeleton, moving.rotation), world_rotations(skeleton, still.rotation)
        self._turns = {n: quaternion.multiply(turned[n], quaternion.conjugate(unturned[n])) for n in chosen}
        self.size = float(np.ptp(self._home[chosen], axis=0).max()) or 1.0

    def placed(self, node: int) -> JointTransform:
        """World position and rotation of a node; −1 is the world itself."""
        if node < 0:
            return ZERO, IDENTITY[None], ZERO
        return self._home[node], self._turns[node], self._places[:, node]


def _node(
    figure: _Skeleton, node: int, name: str, orders: OrderRules, shown: Floats, meters_per_unit: float
) -> EulerNode:
    """A joint with its required curves; lengths in the file's unit, keys at times `shown`."""
    parent = figure.above[node]
    offset, turn, path = _relative_to(figure.placed(node), figure.placed(parent))
    moved = parent < 0 or bool(np.abs(path - offset).max() > CONSTANT_TOLERANCE * figure.size)
    end = parent >= 0 and not moved and node in figure.ends
    order = orders.of(name, turn)
    angles = euler.unwrap(turn, order=order, frame=AxesConvention.INTRINSIC, lock=LOCK_TOLERANCE_RAD)
    return EulerNode(
        name,
        figure.numbers.get(parent, -1),
        offset / meters_per_unit,
        order,
        AxesConvention.INTRINSIC,
        np.zeros(3),
        (None, None, None) if end else tuple(_curves(shown, angles)),
        dict(enumerate(_curves(shown, path / meters_per_unit))) if moved else {},
        end=end,
    )


def _relative_to(node: JointTransform, parent: JointTransform) -> JointTransform:
    """The joint relative to its parent: offset at rest, rotation, and offset at all times."""
    back = quaternion.conjugate(parent[1])
    return node[0] - parent[0], quaternion.multiply(back, node[1]), quaternion.rotate(back, node[2] - parent[2])


def _frames(clip: Clip, fps: float | None) -> tuple[Floats, Floats]:
    """Frame times (F,) on an even grid from 0, and clip times to sample: its keys where they coincide."""
    start, end = clip.start, clip.end
    keys = clip.key_times
    if fps is not None:
        if not (np.isfinite(fps) and fps > 0) or (end - start) * fps > MAX_FRAMES:
            raise RangeError(f"`fps` is {fps:g} (expected a number above 0, and up to {MAX_FRAMES} frames)")
        shown = np.arange(int(np.ceil((end - start) * fps - GRID_TOLERANCE_FRAMES)) + 1) / fps
    else:
        step = (end - start) / max(len(keys) - 1, 1)
        shown = np.asarray(np.arange(len(keys)) * step, np.float64)
        if np.abs(keys - start - shown).max() > GRID_TOLERANCE_FRAMES * step + TIME_ROUNDING_FRACTION * end:
            raise RangeError("keys are not evenly spaced, as a BVH requires", help="choose a frame rate with `fps`")
        return shown, keys
    at = start + shown
    nearest = keys[np.clip(np.searchsorted(keys, at - TIME_ROUNDING_FRACTION * at), 0, len(keys) - 1)]
    return shown, np.where(np.abs(nearest - at) <= TIME_ROUNDING_FRACTION * at, nearest, at)


def _choose_frames(skeleton: Skeleton, clip: Clip, joints: Collection[int]) -> list[int]:
    """Nodes to write, parents first: the joints, the nodes between them, and leaves as end markers."""
    wanted = set(joints) or set(range(len(skeleton)))
    above = nearest_ancestors(skeleton, set(wanted))
    for node in list(wanted):
        if above[node] >= 0:
            wanted.update(takewhile(lambda parent: parent not in wanted, ancestors(skeleton.parents, node)))
    wanted |= _ends(skeleton, clip, wanted)
    return [node for level in skeleton.levels() for node in level.tolist() if node in wanted]


def _ends(skeleton: Skeleton, clip: Clip, among: Collection[int]) -> set[int]:
    """Static leaves named as ends of a node in `among`."""
    parents = skeleton.parents.tolist()
    others = {*parents, *(track.node for track in clip.tracks)}  # no leaf, or moving
    return {
        node
        for node, name in enumerate(skeleton.names)
        if name.casefold().endswith(END_NAME_SUFFIX) and node not in others and parents[node] in among
    }


def _names(skeleton: Skeleton) -> list[str]:
    """Names of all nodes; braces become parentheses, since BVH uses them as delimiters."""
    return unique([name.translate(str.maketrans(BRACES, "()")) for name in labels(skeleton)])


def _rename_nodes(skeleton: Skeleton, names: Sequence[str], chosen: Collection[int]) -> tuple[str, ...]:
    changed = [names[node] for node in sorted(chosen) if set(skeleton.names[node]) & set(BRACES)]
    return (f"braces in names became parentheses: {', '.join(changed)}",) if changed else ()


def _shift_start(clip: Clip) -> tuple[str, ...]:
    return (f"the first key is at {clip.start:.6g} s: a BVH begins there, at 0",) if clip.start > 0 else ()


def _lost_between_frames(clip: Clip, times: Floats) -> tuple[str, ...]:
    """A note on keys that the grid loses."""
    angle, time = frame_error(clip, times)
    if np.degrees(angle) <= NOTED_ERROR_DEG:
        return ()
    error = format_number(float(np.degrees(angle)), 2)
    return (f"between frames, a rotation is up to {error}° from the clip, at {time:.3f} s: a higher rate keeps more",)


def _unsupported_tracks(skeleton: Skeleton, clip: Clip, chosen: Collection[int]) -> list[str]:
    """Descriptions of the tracks that a BVH of the chosen nodes cannot represent."""
    carrying = set(chosen)
    for node in chosen:
        carrying.update(takewhile(lambda above: above not in carrying, ancestors(skeleton.parents, node)))
    names = labels(skeleton)
    return [
        label_of(track, names)
        for track in clip.tracks
        if track.path not in ("translation", "rotation") or track.node not in carrying
    ]


def _curves(times: Floats, values: Floats) -> list[Curve]:
    axis = TimeAxis(times)
    return [linear(axis, column) for column in values.T]
