"""Displacements of a surface's vertices over time: bounds for all, values on demand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from anim.arrays import Floats, Ints

CHUNK = 1_000_000  # vertices × frames per step: 24 MB
MAX_GROUP_VALUES = 250_000  # of the same, of one group with many vertices


class DisplacementField(Protocol):
    """Displacements of a surface's vertices, in groups."""

    @property
    def limits(self) -> Floats:
        """(G, F), upper bounds of the lengths of a group's vectors."""
        ...

    def vectors(self, group: int, frames: Ints) -> Floats:
        """Return the vectors (V_g, 3, f) of a group's vertices in some frames."""
        ...

    def joint(self, group: int, frame: int, vertex: int) -> int:
        """Return the joint of the surface that moves a vertex (−1: any) of a group most in a frame."""
        ...

    def rate(self, step: Floats) -> DisplacementField:
        """Return the rates of change of the vectors between frames. step: (F − 1,) s from each to the next."""
        ...


@dataclass(frozen=True)
class BoundGroups:
    """Vertices in groups, as products in which displacements by joint matrices are linear.

    reach: indices of the joints that influence each group. products: (V_g, J_g · 4) of each group: skin weight
    times x, y, z, 1, per joint. corners: (J, P, 3), corner points around the vertices of each joint. fraction: the
    largest sum of skin weights of a vertex, of all or (J, 1) of each joint.
    """

    reach: Sequence[Ints]
    products: Sequence[Floats]
    corners: Floats
    fraction: Floats | float = 1.0

    @cached_property
    def single(self) -> BoundGroups:
        """The same with products in float32."""
        return replace(self, products=[each.astype(np.float32) for each in self.products])

    @cached_property
    def largest(self) -> float:
        """The largest coordinate in all products."""
        coordinates = (each.reshape(len(each), -1, 4)[..., :3] for each in self.products)
        return max((float(np.abs(each).max(initial=0.0)) for each in coordinates), default=0.0)


class SkinnedDisplacement:
    """Displacements that are linear in the joints' matrices. moved: differences of matrices (J, F, 3, 4)."""

    def __init__(self, groups: BoundGroups, moved: Floats) -> None:
        self._groups, self._moved = groups, moved

    @cached_property
    def limits(self) -> Floats:
        """(G, F), upper bounds of the lengths of a group's vectors."""
        return _by_group(self._bounds, self._groups.reach)

    @cached_property
    def _bounds(self) -> Floats:
        """(J, F), upper bounds of the lengths of vectors with influence of a joint."""
        return np.asarray(self._groups.fraction * largest_over(self._groups.corners, self._moved))

    def in_single_precision(self) -> tuple[SkinnedDisplacement, float]:
        """Return the same in float32, and the largest term, m, of the sums that are its vectors."""
        turned = float(np.abs(self._moved[..., :3]).max(initial=0.0))
        largest = max(self._groups.largest * turned, float(np.abs(self._moved[..., 3]).max(initial=0.0)))
        return SkinnedDisplacement(self._groups.single, self._moved.astype(np.float32)), largest

    def rate(self, step: Floats) -> DisplacementField:
        """Return the rates of change of the vectors between frames. step: (F − 1,) s from each to the next."""
        return SkinnedDisplacement(self._groups, np.diff(self._moved, axis=1) / step[:, None, None])

    def vectors(self, group: int, frames: Ints) -> Floats:
        """Return the vectors (V_g, 3, f) of a group's vertices in some frames."""
        return self._products(self._groups.products[group], group, frames)

    def lengths(self, group: int, frames: Ints) -> Floats:
        """Return the lengths (V_g, f) of the vectors of a group's vertices in some frames."""
        products = self._groups.products[group]
        count = len(products) * len(frames) // MAX_GROUP_VALUES + 1
        if count == 1:
            return vector_lengths(self._products(products, group, frames))
        found, first = np.empty((len(products), len(frames)), np.result_type(products, self._moved)), 0
        for part in np.array_split(products, count):
            found[first : first + len(part)] = vector_lengths(self._products(part, group, frames))
            first += len(part)
        return found

    def _products(self, products: Floats, group: int, frames: Ints) -> Floats:
        """The vectors (V, 3, f) of some of a group's vertices, by their products."""
        chosen = self._moved[self._groups.reach[group]][:, frames].transpose(0, 3, 2, 1)  # (J_g, 4, 3, f)
        flat = products @ chosen.reshape(-1, 3 * len(frames))
        return np.asarray(flat.reshape(-1, 3, len(frames)))

    def uniform_vectors(self, frames: Ints) -> Floats | None:
        """Return the vectors (G, V_g, 3, f) of all groups, None if they differ in numbers of vertices or joints."""
        products = self._groups.products
        if len(products) < 2 or len({each.shape for each in products}) > 1:
            return None
        chosen = self._moved[np.stack(self._groups.reach)][:, :, frames].transpose(0, 1, 4, 3, 2)  # (G, J_g, 4, 3, f)
        flat = np.stack(products) @ chosen.reshape(len(products), -1, 3 * len(frames))
        return np.asarray(flat.reshape(*flat.shape[:2], 3, len(frames)))

    def joint(self, group: int, frame: int, vertex: int) -> int:
        """Return the joint of the surface that moves a vertex (−1: any) of a group most in a frame."""
        reach = self._groups.reach[group]
        if vertex < 0:
            return int(reach[self._bounds[reach, frame].argmax()])
        products = self._groups.products[group][vertex].reshape(len(reach), 4)
        parts = np.einsum("jck,jk->jc", self._moved[reach, frame], products)
        return int(reach[(parts * parts).sum(axis=1).argmax()])


class MorphedDisplacement:
    """Displacements of morphed vertices.

    bounds: (J, F), upper bounds of displacements with influence of a joint. groups: joints that influence each group,
    and indices of its vertices. displaced: function of frames (f,) that returns all vectors (V, 3, f). rates: function
    of steps in s that returns bounds (J, F − 1) of their rates of change.
    """

    def __init__(
        self,
        bounds: Floats,
        groups: tuple[Sequence[Ints], Sequence[Ints]],
        *,
        displaced: Callable[[Ints], Floats],
        rates: Callable[[Floats], Floats],
    ) -> None:
        self._bounds, self._displaced, self._rates = bounds, displaced, rates
        self._reach, self._groups = groups
        self.limits = _by_group(bounds, self._reach)
        self._most = max(CHUNK // max(sum(map(len, self._groups)), 1), 1)  # maximum number of cached frames
        self._kept: dict[int, Floats] = {}

    def rate(self, step: Floats) -> DisplacementField:
        """Return the rates of change of the vectors between frames. step: (F − 1,) s from each to the next."""
        return DisplacementRate(self, step, _by_group(self._rates(step), self._reach))

    def vectors(self, group: int, frames: Ints) -> Floats:
        """Return the vectors (V_g, 3, f) of a group's vertices in some frames."""
        starts = range(0, len(frames), self._most)
        return np.concatenate([self._some(group, frames[i : i + self._most].tolist()) for i in starts], axis=-1)

    def joint(self, group: int, frame: int, vertex: int) -> int:
        """Return the joint of the surface that can move any vertex of a group most in a frame."""
        del vertex
        reach = self._reach[group]
        return int(reach[self._bounds[reach, frame].argmax()])

    def _some(self, group: int, frames: list[int]) -> Floats:
        missing = [frame for frame in frames if frame not in self._kept]
        if len(self._kept) + len(missing) > self._most:
            self._kept.clear()
            missing = frames
        if missing:
            found = np.moveaxis(self._displaced(np.array(missing, np.int64)), -1, 0)
            self._kept.update(zip(missing, found, strict=True))
        return np.stack([self._kept[frame][self._groups[group]] for frame in frames], axis=-1)


class DisplacementRate:
    """Rates of change of any field's vectors from each frame to the next.

    step: (F − 1,) s between frames. limits: (G, F − 1), if known; else derived from the field's own limits.
    """

    def __init__(self, field: DisplacementField, step: Floats, limits: Floats | None = None) -> None:
        self._field, self._step = field, step
        loose = (field.limits[:, 1:] + field.limits[:, :-1]) / step
        self.limits = loose if limits is None else np.minimum(loose, limits)

    def rate(self, step: Floats) -> DisplacementField:
        """Return the rates of change of the rates."""
        return DisplacementRate(self, step)

    def vectors(self, group: int, frames: Ints) -> Floats:
        """Return the vectors (V_g, 3, f) of a group's vertices in some frames, per second."""
        both = np.flatnonzero(np.bincount(np.concatenate((frames, frames + 1))))
        found = self._field.vectors(group, both)
        first, second = np.searchsorted(both, frames), np.searchsorted(both, frames + 1)
        return np.asarray((found[..., second] - found[..., first]) / self._step[frames])

    def joint(self, group: int, frame: int, vertex: int) -> int:
        """Return the joint of the surface that moves a vertex of a group most at the end of a step."""
        return self._field.joint(group, frame + 1, vertex)


def vector_lengths(vectors: Floats) -> Floats:
    """Return the lengths (V, f) of vectors (V, 3, f), which are overwritten."""
    vectors *= vectors
    squares = vectors[:, 0]  # added one by one, in half of the time of a sum over three
    squares += vectors[:, 1]
    squares += vectors[:, 2]
    return np.asarray(np.sqrt(squares, out=squares))


def _by_group(bounds: Floats, reach: Sequence[Ints]) -> Floats:
    """Bounds of groups (G, F) from bounds of joints (J, F)."""
    starts = np.cumsum([0, *map(len, reach[:-1])])
    return np.asarray(np.maximum.reduceat(bounds[np.concatenate(reach)], starts, axis=0))


def largest_over(points: Floats, moved: Floats) -> Floats:
    """Return the largest displacement (J, F) of points (J, P, 3) by matrix differences (J, F, 3, 4)."""
    whole = np.concatenate((points, np.ones((*points.shape[:-1], 1))), axis=-1)
    columns = np.swapaxes(moved, 1, 3)  # (J, 4, 3, F)
    displaced = whole @ columns.reshape(len(moved), 4, 3 * moved.shape[1])  # one product per joint
    displaced *= displaced
    displaced = displaced.reshape(*whole.shape[:2], 3, moved.shape[1])
    squares = displaced[:, :, 0] + displaced[:, :, 1]
    squares += displaced[:, :, 2]
    return np.asarray(np.sqrt(squares.max(axis=1)))
