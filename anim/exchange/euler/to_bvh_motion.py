"""glTF clip → BVH motion: no rest rotation, no scale, frames on an even grid, End Sites."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Bools, Floats, Ints, freeze
from anim.errors import RangeError, UnsupportedError
from anim.exchange.euler.curve import Curve, Mode, uniform_modes
from anim.exchange.euler.frame_error import frame_error, translation_error
from anim.exchange.euler.motion import IDENTITY, ZERO, EulerMotion, EulerNode
from anim.exchange.euler.rotation_order import OrderRules
from anim.exchange.euler.to_euler import LOCK_TOLERANCE_RAD, check_curve_memory
from anim.exchange.formats.labels import label_of, labels, skipped_note, unique
from anim.maths import euler, quaternion
from anim.maths.euler import AxesConvention
from anim.maths.hierarchy import with_ancestors, with_descendants
from anim.model import Clip, Skeleton, TimeAxis, Track
from anim.model.skeleton import nearest_ancestors
from anim.sampling import rest_pose, rest_world, sample_pose, world_matrices
from anim.sampling.times import check_duration, check_fps
from anim.sampling.world import world_rotations
from anim.units import format_number, list_some

GRID_TOLERANCE_FRAMES = 1e-3  # maximum deviation from an even grid, as a fraction of a frame
TIME_ROUNDING_FRACTION = 2e-7  # relative rounding error of float32 times
NOTED_ERROR_DEG = 1.0  # degrees, of rotations between frames
NOTED_ERROR_FRACTION = 0.01  # of the skeleton's size, of translations between frames
SCALE_ROUNDING = 1e-5  # of a scale, in keys of bakes: matrices that were taken apart in float32
CONSTANT_TOLERANCE = 1e-6  # variation of a constant offset, as a fraction of the skeleton's size
BLOCK_VALUES = 1 << 17  # nodes × frames computed at a time
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
    nodes = _nodes(figure, [names[node] for node in chosen], orders, shown, meters_per_unit)
    notes = (
        skipped_note(_unsupported_tracks(skeleton, clip, chosen))
        + _rename_nodes(skeleton, names, chosen)
        + _shift_start(clip)
        + _lost_between_frames(clip, times)
        + _lost_translations(skeleton, clip, times, figure)
    )
    return EulerMotion(tuple(nodes), sampled=True, notes=notes)


class _Skeleton:
    """The nodes to write, in their order, with world positions at rest and at times (F,).

    parents: (N,) index among them of the nearest one above each, −1 for the world, whose frame is the last one of all.
    """

    def __init__(self, skeleton: Skeleton, clip: Clip, chosen: Sequence[int], times: Floats) -> None:
        moving, still = sample_pose(skeleton, clip, times), rest_pose(skeleton)
        is_chosen, is_end = np.zeros((2, len(skeleton)), np.bool_)
        is_chosen[chosen] = True
        is_end[_ends(skeleton, clip, is_chosen)] = True
        numbers = np.full(len(skeleton) + 1, -1)
        numbers[chosen] = np.arange(len(chosen))
        self.parents = numbers[nearest_ancestors(skeleton.parents, is_chosen)[chosen]]
        self.is_end = is_end[chosen]
        self._home = _with_world(rest_world(skeleton)[chosen, :, 3], ZERO)
        self._places = _with_world(world_matrices(skeleton, moving)[..., 3][:, chosen], ZERO)
        turned, unturned = (world_rotations(skeleton, pose.rotation)[chosen] for pose in (moving, still))
        turns = quaternion.multiply(turned, quaternion.conjugate(unturned))
        self._turns = _with_world(turns.swapaxes(0, 1), IDENTITY)
        own = float(np.ptp(self._home[:-1], axis=0).max())
        self.size = own or 1.0
        self.extent = own or float(np.ptp(self._places[:, :-1], axis=(0, 1)).max())  # of the path, without a size

    def relative(self, some: slice) -> tuple[Floats, Floats, Floats]:
        """Nodes relative to their parents: offset at rest (n, 3), rotation from rest (F, n, 4), offset (F, n, 3)."""
        above = self.parents[some]
        back = quaternion.conjugate(self._turns[:, above])
        path = quaternion.rotate(back, self._places[:, :-1][:, some] - self._places[:, above])
        turn = quaternion.multiply(back, self._turns[:, :-1][:, some])
        return self._home[:-1][some] - self._home[above], turn, path


def _with_world(values: Floats, own: Floats) -> Floats:
    """Values (..., N, C) and after them those of the world."""
    last = np.broadcast_to(own, (*values.shape[:-2], 1, values.shape[-1]))
    return np.concatenate((values, last), axis=-2)


def _nodes(
    figure: _Skeleton, names: Sequence[str], orders: OrderRules, shown: Floats, meters_per_unit: float
) -> list[EulerNode]:
    """Joints with their required curves, none for angles that stay 0; lengths in the file's unit, keys at `shown`."""
    axis, size = TimeAxis(shown), max(1, BLOCK_VALUES // len(shown))
    modes = uniform_modes(len(shown), Mode.LINEAR)
    made = []
    for first in range(0, len(names), size):
        some = slice(first, first + size)
        offset, turn, path = figure.relative(some)
        offsets, parents = offset / meters_per_unit, figure.parents[some]
        moved = (parents < 0) | (np.abs(path - offset).max(axis=(0, 2)) > CONSTANT_TOLERANCE * figure.size)
        end = (parents >= 0) & ~moved & figure.is_end[some]
        chosen = [orders.of(name, turn[:, i]) for i, name in enumerate(names[some])]
        angles, paths = _by_curve(_angles(turn, chosen)), _by_curve(path / meters_per_unit)
        still = end | ~angles.any(axis=(1, 2))
        for i, name in enumerate(names[some]):
            made.append(
                EulerNode(
                    name,
                    int(parents[i]),
                    offsets[i],
                    chosen[i],
                    AxesConvention.INTRINSIC,
                    ZERO,
                    (None, None, None) if still[i] else tuple(_curves(axis, angles[i], modes)),
                    dict(enumerate(_curves(axis, paths[i], modes))) if moved[i] else {},
                    end=bool(end[i]),
                )
            )
    return made


def _angles(turn: Floats, orders: Sequence[str]) -> Floats:
    """Continuous angles (F, n, 3) of rotations (F, n, 4), each node by its order."""
    found = np.empty((*turn.shape[:-1], 3))
    for order in set(orders):
        own = np.array([each == order for each in orders])
        found[:, own] = euler.unwrap(turn[:, own], order=order, frame=AxesConvention.INTRINSIC, lock=LOCK_TOLERANCE_RAD)
    return found


def _frames(clip: Clip, fps: float | None) -> tuple[Floats, Floats]:
    """Frame times (F,) on an even grid from 0, and clip times to sample: its keys where they coincide."""
    start, end = clip.start, clip.end
    keys = clip.key_times
    if fps is not None:
        fps = check_fps(fps)
        frames = check_duration(start, end, fps=fps)
        check_curve_memory(clip, math.ceil(frames))
        shown = np.arange(int(np.ceil(frames - GRID_TOLERANCE_FRAMES)) + 1) / fps
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
    wanted = np.zeros(len(skeleton), np.bool_)
    wanted[list(joints) or slice(None)] = True
    wanted = with_ancestors(skeleton.parents, wanted) & with_descendants(skeleton.parents, wanted)
    wanted[_ends(skeleton, clip, wanted)] = True
    order: Ints = np.concatenate([np.zeros(0, np.int64), *skeleton.levels()])
    chosen: list[int] = order[wanted[order]].tolist()
    return chosen


def _ends(skeleton: Skeleton, clip: Clip, among: Bools) -> list[int]:
    """Static leaves named as ends of a node in `among` (N,)."""
    parents = skeleton.parents.tolist()
    others = {*parents, *(track.node for track in clip.tracks)}  # no leaf, or moving
    return [
        node
        for node, name in enumerate(skeleton.names)
        if node not in others
        and name.casefold().endswith(END_NAME_SUFFIX)
        and parents[node] >= 0
        and among[parents[node]]
    ]


def _names(skeleton: Skeleton) -> list[str]:
    """Names of all nodes; braces become parentheses, since BVH uses them as delimiters."""
    parentheses = str.maketrans(BRACES, "()")
    return unique([name.translate(parentheses) for name in labels(skeleton)])


def _rename_nodes(skeleton: Skeleton, names: Sequence[str], chosen: Collection[int]) -> tuple[str, ...]:
    changed = [names[node] for node in sorted(chosen) if set(skeleton.names[node]) & set(BRACES)]
    return (f"braces in names became parentheses: {list_some(changed)}",) if changed else ()


def _shift_start(clip: Clip) -> tuple[str, ...]:
    return (f"the first key is at {clip.start:.6g} s: a BVH begins there, at 0",) if clip.start > 0 else ()


def _lost_between_frames(clip: Clip, times: Floats) -> tuple[str, ...]:
    """A note on keys that the grid loses."""
    angle, time = frame_error(clip, times)
    if np.degrees(angle) <= NOTED_ERROR_DEG:
        return ()
    error = format_number(float(np.degrees(angle)), 2)
    return (f"between frames, a rotation is up to {error}° from the clip, at {time:.3f} s: a higher rate keeps more",)


def _lost_translations(skeleton: Skeleton, clip: Clip, times: Floats, figure: _Skeleton) -> tuple[str, ...]:
    """A note on translations that the grid loses."""
    widening = np.sqrt((rest_world(skeleton)[..., :3] ** 2).sum(axis=-2)).max(axis=-1)
    distance, time = translation_error(clip, times, np.where(skeleton.parents < 0, 1.0, widening[skeleton.parents]))
    if distance <= max(NOTED_ERROR_FRACTION * figure.extent, CONSTANT_TOLERANCE * figure.size):
        return ()
    error = format_number(distance, 2)
    return (f"between frames, a node is up to {error} m from the clip, at {time:.3f} s: a higher rate keeps more",)


def _unsupported_tracks(skeleton: Skeleton, clip: Clip, chosen: Collection[int]) -> list[str]:
    """Descriptions of the tracks that a BVH of the chosen nodes cannot represent."""
    carrying = np.zeros(len(skeleton), np.bool_)
    carrying[list(chosen)] = True
    carrying = with_ancestors(skeleton.parents, carrying)
    lost = [
        track
        for track in clip.tracks
        if (track.path not in ("translation", "rotation") and not _keeps_scale(skeleton, track))
        or track.node is None
        or not carrying[track.node]
    ]
    names = labels(skeleton) if lost else []
    return [label_of(track, names) for track in lost]


def _keeps_scale(skeleton: Skeleton, track: Track) -> bool:
    """Return whether a track only repeats the scale at rest, as exporters write it for every node."""
    if track.path != "scale" or track.node is None:
        return False
    return bool(np.abs(track.values - skeleton.scale[track.node]).max() <= SCALE_ROUNDING * skeleton.scale.max())


def _by_curve(values: Floats) -> Floats:
    """Values (n, 3, F) of each curve from those (F, n, 3) of frames, read-only, so that curves share them."""
    return freeze(values.transpose(1, 2, 0).copy())


def _curves(axis: TimeAxis, values: Floats, modes: NDArray[np.uint8]) -> list[Curve]:
    return [Curve(axis, each, modes) for each in values]
