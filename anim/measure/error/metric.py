"""Error metric: the distance between two versions of a clip on the surface, with position and time.

Reported errors are upper bounds at the sampled times. Times are processed in blocks, so that memory does not depend on
the length of a clip.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import starmap
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Bools, Floats, Ints
from anim.measure.compare.correspondence import Correspondence, match_scenes
from anim.measure.error.combined_groups import combine_groups
from anim.measure.error.max_displacement import max_displacement
from anim.measure.error.merged_groups import merge_points, merge_surfaces
from anim.measure.error.motion_error import MotionError
from anim.measure.error.point_groups import PointGroups, SkinnedGroups
from anim.measure.error.pointer_error import find_still_weights, pointer_error, still_weight_error
from anim.measure.error.posed_clips import AskedTimes, RecentSamplers, Samplers, pose_clips
from anim.measure.error.reduced_skeleton import ReducedSkeleton, reduce_skeletons
from anim.measure.error.sample_times import dense_times
from anim.measure.error.shell_points import ShellPoints, points_around_nodes
from anim.measure.error.surface import Surface, diagonal, has_vertices, surfaces
from anim.measure.error.whole_scene import WholeScene
from anim.model import Clip, Scene
from anim.sampling.players import parse_pair, sampler, sampler_for
from anim.sampling.pose import PosedSkeleton, PoseSampler
from anim.sampling.scene_parts import SceneDivider
from anim.sampling.weight_pointers import resolve_weight_pointers

NOISE = 1e-7  # of the diagonal: below is the rounding of float32 files, and no vertex is searched
SLACK = 1.001  # factor: a bound this close to a found error is not refined
MAX_SEARCHED = 40_000_000  # vertices per surface and block; if there are more, the bound of the rest is reported
BLOCK = 40_000  # matrices of nodes per block, each about 600 bytes with derived values
MIN_TIMES = 4  # of a block: with fewer, work per block takes longer than that per time


class Block(NamedTuple):
    """Some of the times (F,) in s, with the poses of both versions."""

    times: Floats
    old: PosedSkeleton
    new: PosedSkeleton


class ErrorSamples(NamedTuple):
    """Errors at some times (F,), in one or several players.

    error, player: the largest, and the player with it. block: the poses, if they are those of one player and one block.
    limits: by player, of each part of the metric (G, F) in m,
    upper bounds of the displacement of a group's vertices; 0 without joints. In float32, since there are many.
    """

    error: MotionError
    player: str
    limits: Mapping[str, Sequence[NDArray[np.float32]]]
    block: Block | None = None


class ErrorMetric:
    """Error metric for clips on one scene, or on two corresponding ones: prepares what all clips share.

    other: the scene of the second clip: with another rest pose, other node indices, another file. The first scene's
    surface is moved by both scenes, so that only motion counts (`anim.measure.compare.correspondence`).
    combined: the parts without morph targets as one, then the others.
    shell: m, the distance of six points around each node that moves no vertex; None ignores such nodes, except in a
    scene without vertices: that is measured at cubes on its nodes.
    clips: all that will be measured, if known: then nodes of large scenes that none of them moves cost nothing.
    whole: what `scene` is a part of; its other nodes don't move.
    num_static_points: number of vertices of rigid meshes, or of points of shells if there are none, on nodes that no
    clip moves, and outside of a part: in no group. has_shell: whether there are such nodes, measured on a shell.
    """

    def __init__(
        self,
        scene: Scene,
        other: Scene | None = None,
        *,
        shell: float | None = None,
        clips: Iterable[Clip] | None = None,
        whole: WholeScene | None = None,
    ) -> None:
        self.scene, self.other = scene, other or scene
        self.shell, self.whole = shell, whole or WholeScene.of(scene, diagonal(scene))
        self.diagonal = self.whole.diagonal
        found = surfaces(scene) if has_vertices(scene) else []
        self.pairs: Correspondence = match_scenes(scene, self.other, found)
        if shell is None and not found and (self.pairs.nodes < 0).any():
            found = surfaces(scene)
            self.pairs = match_scenes(scene, self.other, found)
        self._reduced = None if clips is None else self._reduce(clips, found)
        self.skeletons = (scene.skeleton, self.other.skeleton) if self._reduced is None else self._reduced.versions
        nodes, points = points_around_nodes(scene, self.pairs.nodes, found, shell, self.diagonal)
        self.has_shell = shell is not None and len(nodes) > 0
        has_cubes = shell is None and not found
        self.parts: list[PointGroups] = []
        self.num_static_points = 0
        if self._reduced is None:
            self.parts += [SkinnedGroups(*each) for each in self.pairs.surfaces]
            if shell is not None or has_cubes:
                self.parts.append(ShellPoints(nodes, self.pairs.nodes[nodes], points, has_vertices=has_cubes))
        else:
            groups, self.num_static_points = merge_surfaces(self.pairs.surfaces, self._reduced)
            around = merge_points(nodes, points, scene.skeleton.display_name, self._reduced, vertices=has_cubes)
            if not self.pairs.surfaces:
                self.num_static_points = points[..., 0].size - sum(len(g) for each in around for g in each.groups)
            self.parts += [*groups, *around]
        self.num_static_points += self.whole.count_other_points(scene, points.shape[1])
        self.combined = combine_groups(self.parts)
        self._recent = RecentSamplers()

    def part(self, before: Clip, after: Clip) -> tuple[ErrorMetric, Clip, Clip] | None:
        """Return the metric of the part of the scene that two clips move, with the clips for it.

        None if the part is not small. Both scenes must be equal: the first one's part stands for both.
        """
        if (found := self._divider.part((before, after))) is None:
            return None
        clips = found.into(before), found.into(after)
        return ErrorMetric(found.scene, shell=self.shell, clips=clips, whole=self.whole), *clips

    @cached_property
    def _divider(self) -> SceneDivider:
        return SceneDivider(self.scene)

    def _reduce(self, clips: Iterable[Clip], surfaces: Sequence[Surface]) -> ReducedSkeleton | None:
        """The skeletons without static nodes, None where that is not possible or not worth it."""
        one, other = self.scene.skeleton, self.other.skeleton
        if not np.array_equal(self.pairs.nodes, np.arange(len(other))):
            return None
        morphing = [each.owner for each in surfaces if len(each.targets)]
        morphing += [new.owner for _, new in self.pairs.surfaces if new is not None and len(new.rest_weights)]
        return reduce_skeletons(one, other, clips, [node for node in morphing if node >= 0])

    @property
    def partners(self) -> Ints:
        """For each node of the first of `skeletons` its index in the second, −1 without one."""
        return self.pairs.nodes if self._reduced is None else np.arange(len(self.skeletons[0]))

    def clips(self, before: Clip, after: Clip) -> tuple[Clip, Clip]:
        """Return both clips for `skeletons`."""
        return (before, after) if self._reduced is None else (self._reduced.clip(before), self._reduced.clip(after))

    def error(self, before: Clip, after: Clip, *, player: str = "spec") -> MotionError:
        """Return the error of `after` at the times of `sample_times.dense_times`.

        Between them it may be larger: `anim.measure.continuous_bound.largest_error` bounds it there too.
        """
        return self.error_at(before, after, dense_times(before, after), player=player)

    def error_at(self, before: Clip, after: Clip, times: Floats, *, player: str = "spec") -> MotionError:
        """Return the error of `after` at `times` (F,) in seconds.

        player: a name in PLAYERS, for both clips; or two, "spec,nlerp", for `before` and `after`.
        """
        return self._sampled(before, after, times, (player,), None)[0]

    def sample_errors(
        self, before: Clip, after: Clip, times: Floats, *, players: Sequence[str] = ("spec",)
    ) -> ErrorSamples:
        """Return the largest error in any of the players at `times` (F,), with limits for all times and groups."""
        limits = {
            player: [np.zeros((len(part.groups), len(times)), np.float32) for part in self.combined]
            for player in players
        }
        error, player, block = self._sampled(before, after, times, players, limits)
        return ErrorSamples(error, player, limits, block if len(players) == 1 else None)

    def _sampled(
        self,
        before: Clip,
        after: Clip,
        times: Floats,
        players: Sequence[str],
        limits: Mapping[str, Sequence[NDArray[np.float32]]] | None,
    ) -> tuple[MotionError, str, Block | None]:
        """The largest error, its player, and the block if there is only one.

        limits: arrays to write the limits of groups into, or None.
        """
        size, frame, place, joint, vertex, worst, around = 0.0, 0, "", -1, -1, players[0], False
        first, only = 0, None
        for block in self._blocks_of_players(before, after, times, players):
            count = len(block.times) // len(players)
            only = block if count == len(times) else None
            shown = ((i, part.field(block.old, block.new)) for i, part in enumerate(self.combined))
            fields = [(i, field) for i, field in shown if field is not None]
            for i, field in sorted(fields, key=lambda each: -float(each[1].limits.max())):
                part = self.combined[i]
                found = max_displacement(field, floor=max(size, NOISE * self.diagonal), slack=SLACK, most=MAX_SEARCHED)
                if limits is not None:
                    rounded = _round_up(found.limits).reshape(-1, len(players), count)
                    for p, player in enumerate(players):
                        limits[player][i][:, first : first + count] = rounded[:, p]
                if found.length > size:
                    size, vertex, worst = found.length, part.vertex(found), players[found.frame // count]
                    frame = first + found.frame % count
                    joint = part.node(field.joint(found.group, found.frame, found.vertex))
                    place = part.name_of(found) or self.called(joint)
                    around = self.whole.num_vertices > 0 and part.is_shell(found.group)
            first += count
        time = float(times[frame]) if len(times) else 0.0
        old, new = (
            resolve_weight_pointers(s.skeleton, clip) for s, clip in ((self.scene, before), (self.other, after))
        )
        fraction, pointer = self._pointer_error(old, new, times)
        called = self.called(joint)
        return MotionError(size, time, place, called, len(times), fraction, pointer, vertex, around), worst, only

    def _pointer_error(self, before: Clip, after: Clip, times: Floats) -> tuple[float, str]:
        """The largest error of a track that moves nothing, as a fraction of its range, and its name."""
        pointer = pointer_error(before, after, times)
        fraction, node = still_weight_error(before, after, times, self.pairs.nodes, self._find_still_weights)
        if fraction <= pointer[0]:
            return pointer
        return fraction, f"the weights of '{self.scene.skeleton.display_name(node)}'"

    @cached_property
    def _find_still_weights(self) -> Callable[[int], Bools]:
        return find_still_weights(self.scene)

    def _blocks_of_players(self, before: Clip, after: Clip, times: Floats, players: Sequence[str]) -> Iterator[Block]:
        """Yield blocks of `times` (F,) in s, with both clips posed by every player in turn."""
        pairs = [parse_pair(player) for player in players]
        samplers = [
            (poses, [sampler(pair[i]) for pair in pairs]) for i, poses in enumerate(self._pose_samplers(before, after))
        ]
        length = max(self.length // len(players), 1)
        for start in range(0, max(len(times), 1), length):
            chosen = times[start : start + length]
            old, new = (
                PosedSkeleton(skeleton, poses.at_each(chosen, samples))
                for skeleton, (poses, samples) in zip(self.skeletons, samplers, strict=True)
            )
            yield Block(old.times, old, new)

    def blocks(
        self, before: Clip, after: Clip, times: Floats, *, player: str = "spec", overlap: int = 0
    ) -> Iterator[Block]:
        """Yield blocks of `times` (F,) in s, with both clips posed by a player, or by one player each.

        overlap: number of times that a block shares with the next one.
        """
        old, new = (
            sampler_for(skeleton, clip, player=name)
            for skeleton, clip, name in zip(self.skeletons, self.clips(before, after), parse_pair(player), strict=True)
        )
        for start in range(0, max(len(times) - overlap, 1), self.length):
            chosen = times[start : start + self.length + overlap]
            yield Block(chosen, old.posed(chosen), new.posed(chosen))

    @property
    def length(self) -> int:
        """Maximum number of times of a block."""
        matrices = sum(len(part.groups) for part in self.parts) + sum(map(len, self.skeletons))
        return max(BLOCK // max(matrices, 1), MIN_TIMES)

    def posed(
        self, clips: Sequence[tuple[Clip, Clip]], asked: Sequence[AskedTimes]
    ) -> tuple[PosedSkeleton, PosedSkeleton]:
        """Return both versions of clips posed at some times by one player, at others by the next, concatenated.

        asked: not more times than `length` in total.
        """
        numbers = sorted({n for each in asked for n in each.clip.tolist()})
        samplers = {n: self._pose_samplers(*clips[n]) for n in numbers}
        old, new = (
            pose_clips(skeleton, {n: each[k] for n, each in samplers.items()}, asked)
            for k, skeleton in enumerate(self.skeletons)
        )
        return old, new

    def _pose_samplers(self, before: Clip, after: Clip) -> Samplers:
        """The samplers of both clips, those of an earlier call if the clips are the same: their keys are stacked."""
        found = self._recent.find(before, after)
        if found is None:
            old, new = starmap(PoseSampler, zip(self.skeletons, self.clips(before, after), strict=True))
            found = self._recent.add(before, after, (old, new))
        return found

    def called(self, node: int) -> str:
        """Return the name of a node of `skeletons` for reports: its own, or "node 7"; "" for −1."""
        if self._reduced is not None:
            node = int(self._reduced.nodes[node])
        return self.scene.skeleton.display_name(node) if node >= 0 else ""


def _round_up(values: Floats) -> NDArray[np.float32]:
    """The values rounded up to float32."""
    near = values.astype(np.float32)
    return np.where(near < values, np.nextafter(near, np.float32(np.inf)), near)
