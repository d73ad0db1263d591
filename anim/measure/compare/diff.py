"""Difference between the motion of two files: clips matched, each one measured, worst first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import AnimError
from anim.gltf.document import Json
from anim.gltf.reading.reader import clip_label
from anim.measure.compare import name_matching
from anim.measure.compare.correspondence import Correspondence
from anim.measure.compare.equal_scenes import are_equal, no_error
from anim.measure.compare.static_pointers import add_static_pointers
from anim.measure.continuous_bound.prover import Prover
from anim.measure.equal_clips import first_equal
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.motion_error import MotionError
from anim.measure.error.sample_times import FPS, dense_times
from anim.measure.error.statistics import Peak, Statistics, statistics
from anim.model import Clip, Scene, Track
from anim.sampling.players import parse_pair
from anim.units import FEW, list_some

END_TOLERANCE_S = 1e-6  # smaller differences of clip ends come from rounding


class ClipDiff(NamedTuple):
    """Difference of two corresponding clips.

    old, new: their indices in the files. certified: m, upper bound of the error at all times; None if it could not be
    proven. end_old, end_new: s, their last keys.
    missing, added: targets of tracks of only the old or only the new clip: (node or pointer, path).
    unmeasured: pointers among these to properties whose value in the other file is not known.
    """

    old: int
    new: int
    name: str
    new_name: str
    error: MotionError
    certified: float | None
    statistics: Statistics
    end_old: float
    end_new: float
    missing: tuple[tuple[str, str], ...]
    added: tuple[tuple[str, str], ...]
    unmeasured: tuple[str, ...] = ()


class Diff(NamedTuple):
    """Two files.

    diagonal: m, of the old scene's bounding box. clips: worst first. missing_clips, added_clips: numbers of those that
    only the old or only the new file has. missing_nodes, added_nodes: names of nodes likewise.
    by_vertex: whether every mesh has the same vertices, weights and morph targets in both files; where not, the old
    ones are carried by the new joints. warnings: differences beyond those that distances state, a sentence each.
    """

    diagonal: float
    clips: tuple[ClipDiff, ...]
    missing_clips: tuple[int, ...]
    added_clips: tuple[int, ...]
    missing_nodes: tuple[str, ...]
    added_nodes: tuple[str, ...]
    by_vertex: bool
    warnings: tuple[str, ...] = ()

    @property
    def max_error(self) -> float:
        """The largest distance between any two clips, in m; infinite if the new file lacks one."""
        return math.inf if self.missing_clips else max((each.error.max_error for each in self.clips), default=0.0)

    def __repr__(self) -> str:
        counts = f"clips={len(self.clips)}, missing={len(self.missing_clips)}, added={len(self.added_clips)}"
        return f"Diff(max_error={self.max_error:.6g}, {counts})"


def diff(
    ruler: ErrorMetric,
    old: Sequence[Clip],
    new: Sequence[Clip],
    *,
    chosen: Sequence[int] | None = None,
    player: str = "spec",
    fps: float = FPS,
    documents: tuple[Json | None, Json | None] = (None, None),
) -> Diff:
    """Return the difference of the `new` clips from the `old` ones, on the two scenes of the metric.

    chosen: indices of the old clips to compare, all by default. player: a name in PLAYERS, for both, or two,
    "spec,nlerp": then `old` and `new` can be the same clips, and nothing is proven between the sampled times.
    fps: frames per second of the grid that is sampled in addition to the keys of both.
    documents: JSON of both files, with the values of properties that only one of two clips animates.
    Clips are matched by name, then in order if one has no name or the files have no name in common.
    """
    partners = name_matching.match_by_name_then_order([clip.name for clip in old], [clip.name for clip in new])
    wanted = range(len(old)) if chosen is None else chosen
    pairs = [(i, int(partners[i])) for i in wanted if partners[i] >= 0]
    found = _compare_pairs(Prover(ruler), old, new, pairs, documents, player=player, fps=fps)
    found.sort(key=lambda each: -each.error.max_error)
    taken = set(partners.tolist())
    nodes = ruler.pairs.nodes
    return Diff(
        ruler.diagonal,
        tuple(found),
        tuple(i for i in wanted if partners[i] < 0),
        () if chosen is not None else tuple(i for i in range(len(new)) if i not in taken),
        _names(ruler.scene, np.flatnonzero(nodes < 0)),
        _names(ruler.other, _missing(nodes, len(ruler.other.skeleton))),
        ruler.pairs.by_vertex,
        (*_mesh_warnings(ruler.pairs), *_end_warnings(found), *_pointer_warnings(found)),
    )


def _missing(nodes: Ints, count: int) -> Ints:
    """Indices below `count` that are not in `nodes`; np.setdiff1d loads a quarter of numpy for that."""
    return np.flatnonzero(np.bincount(nodes[nodes >= 0], minlength=count) == 0)


def _mesh_warnings(pairs: Correspondence) -> Iterator[str]:
    """Yield sentences on meshes that the second file deforms differently."""
    if not pairs.has_meshes:
        yield "the second file has no vertices: the first one's are measured as its joints move them"
    if not pairs.had_meshes:
        yield "the first file has no vertices: nodes are measured, not the meshes of the second file"
    if pairs.unskinned:
        yield f"{_listed(pairs.unskinned)} no skin in the second file: measured as the node of the mesh moves it"
    if pairs.skinned:
        yield f"{_listed(pairs.skinned)} a skin in the second file only: measured as the node of the mesh moves it"
    if pairs.reduced:
        yield f"{_listed(pairs.reduced)} fewer primitives in the second file: the first one's are measured"
    if pairs.lost:
        yield f"{_listed(pairs.lost)} no counterpart in the second file: the first one's are measured"
    if pairs.reweighted:
        yield (
            f"{_listed(pairs.reweighted)} other joints, weights or morph targets in the second file: "
            "the first one's are measured"
        )


def _end_warnings(clips: Sequence[ClipDiff]) -> Iterator[str]:
    """Yield a sentence on clips that end at another time."""
    ends = [each for each in clips if abs(each.end_old - each.end_new) > END_TOLERANCE_S]
    if ends:
        first, more = ends[0], f" (and {len(ends) - 1} more)" if len(ends) > 1 else ""
        clip = clip_label(first.name, first.old)
        yield (
            f"{clip} ends at {first.end_new:.6g} s instead of {first.end_old:.6g} s{more}: "
            "as a loop it repeats at another time"
        )


def _pointer_warnings(clips: Sequence[ClipDiff]) -> Iterator[str]:
    """Yield a sentence on properties that only one file animates, without a value in the other one."""
    pointers = list(dict.fromkeys(pointer for each in clips for pointer in each.unmeasured))
    if pointers:
        yield f"{list_some(pointers, FEW)}: animated in one file only, without a known value in the other: not measured"


def _listed(names: Sequence[str]) -> str:
    """Names of meshes and the verb: "mesh 'body' has", "meshes 'body', 'hair' and 3 more have"."""
    if len(names) == 1:
        return f"mesh '{names[0]}' has"
    quoted = [f"'{name}'" for name in names]
    return f"meshes {list_some(quoted, FEW)} have"


def _compare_pairs(
    prover: Prover,
    old: Sequence[Clip],
    new: Sequence[Clip],
    pairs: Sequence[tuple[int, int]],
    documents: tuple[Json | None, Json | None],
    *,
    player: str,
    fps: float,
) -> list[ClipDiff]:
    """The differences of clips by index. Pairs with equal tracks are measured once."""
    first = first_equal([(old[i], new[j]) for i, j in pairs])
    same_scenes = are_equal(prover.ruler.scene, prover.ruler.other, prover.ruler.pairs)
    alike = len(set(parse_pair(player))) == 1 and same_scenes
    found: list[ClipDiff] = []
    for n, (i, j) in enumerate(pairs):
        if first[n] < n:
            found.append(found[first[n]]._replace(old=i, new=j, name=old[i].name, new_name=new[j].name))
            continue
        before, no_old_value = add_static_pointers(old[i], new[j], documents[0])
        after, no_new_value = add_static_pointers(new[j], old[i], documents[1])
        try:
            times = dense_times(before, after, fps=fps)
        except AnimError as error:
            raise error.at(clip_label(before.name, i)) from None
        if alike and before.tracks == after.tracks:
            measured = _Measured(no_error(times), 0.0, STILL)
        else:
            part = prover.ruler.part(before, after) if same_scenes else None
            placed = (prover, before, after) if part is None else (Prover(part[0]), *part[1:])
            measured = _measure(*placed, times, player=player, fps=fps)
        ends = old[i].end, new[j].end
        missing, added = _lost(prover.ruler, old[i], new[j])
        unmeasured = no_old_value + no_new_value
        found.append(ClipDiff(i, j, before.name, after.name, *measured, *ends, missing, added, unmeasured))
    return found


class _Measured(NamedTuple):
    """Fields of a `ClipDiff` that take long."""

    error: MotionError
    certified: float | None
    statistics: Statistics


STILL = Statistics(0.0, 0.0, Peak(), Peak(), Peak())  # of equal clips


def _measure(prover: Prover, before: Clip, after: Clip, times: Floats, *, player: str, fps: float) -> _Measured:
    ruler = prover.ruler
    look = ruler.sample_errors(before, after, times, players=(player,))
    error, bound = look.error, None
    if len(set(parse_pair(player))) == 1:
        proof = prover.certified(before, after, times, look)
        error, bound = proof.error, proof.bound
    found = statistics(ruler, before, after, times=times, block=look.block, player=player, fps=fps)
    return _Measured(error, bound, found.capped(error.max_error))


def _lost(
    ruler: ErrorMetric, before: Clip, after: Clip
) -> tuple[tuple[tuple[str, str], ...], tuple[tuple[str, str], ...]]:
    """Targets of tracks of only the old clip, and of only the new one."""
    nodes = ruler.pairs.nodes
    one = {_target(track, int(nodes[track.node]) if track.node is not None else -1): track for track in before.tracks}
    other = {_target(track, track.node if track.node is not None else -1): track for track in after.tracks}
    missing = tuple(_label(ruler.scene, track) for key, track in one.items() if key not in other)
    return missing, tuple(_label(ruler.other, track) for key, track in other.items() if key not in one)


def _target(track: Track, node: int) -> tuple[object, str]:
    """Target of a track, comparable between both scenes. node: in the second one, −1 for none."""
    if track.node is None:
        return track.pointer, track.path
    return node if node >= 0 else ("unmatched", track.node), track.path


def _label(scene: Scene, track: Track) -> tuple[str, str]:
    return track.pointer or "" if track.node is None else scene.skeleton.display_name(track.node), track.path


def _names(scene: Scene, nodes: Ints) -> tuple[str, ...]:
    return tuple(scene.skeleton.display_name(i) for i in nodes.tolist())
