"""A file as rules see it: document, clips, skeleton, scene and the report of `inspect`, each read once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.check.finding import Occurrence
from anim.check.track_table import TrackTable, add_counts, keep_earliest, track_tables
from anim.gltf.document import Document, Json, json_array, node_label
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.maths.hierarchy import find_subtrees
from anim.measure.equal_clips import first_equal
from anim.measure.error.surface import diagonal
from anim.measure.inspect.contents import FileContents
from anim.measure.inspect.report import ClipReport, Facts
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.end_frames import EndFrame, EndFrameKind, find_end_frames
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Interpolation, Scene, Skeleton, Track
from anim.sampling.pose import rest_world


@dataclass(frozen=True, eq=False)
class CheckedFile:
    """A file to check. contents: its readable parts. facts: their report; rules look at its clips only.

    missing: label, JSON pointer and problem of each file that it names and that isn't there.
    budget: limits by name (see `budget`). budget_place: the place of these limits in the settings, "" if unknown.
    source: the file that its error is measured against, if there is a limit.
    """

    contents: FileContents
    facts: Facts
    missing: Sequence[tuple[str, str, str]] = ()
    budget: Mapping[str, float] = field(default_factory=dict)
    source: CheckedFile | None = None
    budget_place: str = ""

    @property
    def document(self) -> Document:
        """The document, or the readable part of an invalid one."""
        return self.contents.document

    @property
    def json(self) -> Json:
        """The JSON of the document."""
        return self.contents.document.json

    @property
    def skeleton(self) -> Skeleton:
        """All nodes in their rest pose."""
        return self.contents.skeleton

    @property
    def scene(self) -> Scene:
        """Skeleton and meshes; without meshes if their vertices can't be read."""
        return self.contents.scene or Scene(self.contents.skeleton, ())

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the model at rest in metres (of its nodes if it has no vertices)."""
        return diagonal(self.scene)

    @cached_property
    def rest_world(self) -> Floats:
        """World matrices of all nodes at rest (N, 3, 4)."""
        return rest_world(self.skeleton)

    @property
    def motion(self) -> SkinMotion:
        """Motion of the scene's vertices."""
        return self.contents.motion

    @cached_property
    def joints(self) -> list[int]:
        """Indices of the nodes that are joints of a skin, sorted."""
        return sorted({joint for skin in json_array(self.json, "skins") for joint in skin["joints"]})

    @cached_property
    def subtrees(self) -> tuple[Ints, Ints]:
        """First position (N,) of each node's subtree in depth-first order, and the one after its last."""
        return find_subtrees(self.skeleton.parents)

    def have_common_root(self, nodes: Sequence[int]) -> bool:
        """Return whether some node is above all of these, or one of them."""
        return len(set(self._roots[nodes].tolist())) == 1  # np.unique imports much

    @cached_property
    def _roots(self) -> Ints:
        """The number (N,) of each node's tree in depth-first order."""
        first, _ = self.subtrees
        return np.searchsorted(np.sort(first[self.skeleton.parents < 0]), first, side="right")

    def tracks(self, path: str, wanted: Callable[[Track], bool] = lambda track: True) -> Iterator[TrackTable]:
        """Yield the keys of tracks of a path in the chosen clips, those of some tracks at a time."""
        return track_tables([each for each in self._tracks_by_path.get(path, ()) if wanted(each[1])], path)

    @cached_property
    def _tracks_by_path(self) -> dict[str, list[tuple[int, Track]]]:
        """Tracks with a node of the chosen clips, with the indices of their clips."""
        found: dict[str, list[tuple[int, Track]]] = {}
        for report, clip in self.clips:
            for track in clip.tracks:
                if track.node is not None:
                    found.setdefault(track.path, []).append((report.index, track))
        return found

    def per_clip(self, counted: Iterable[tuple[TrackTable, Ints]]) -> Iterator[Occurrence]:
        """Yield an occurrence for each clip with counts of its tracks (T,) above 0."""
        sums: dict[int, int] = {}
        for table, counts in counted:
            add_counts(sums, table, counts)
        for clip, count in sums.items():
            yield self.in_clip(clip, count)

    def at_keys(
        self, found: Iterable[tuple[TrackTable, Bools]], count: Callable[[Ints], Ints] = lambda counts: counts
    ) -> Iterator[Occurrence]:
        """Yield an occurrence for each clip with marked keys (S,), at the first of them.

        count: the count of each track, by the number of its marked keys.
        """
        sums: dict[int, int] = {}
        first: dict[int, tuple[int, float]] = {}
        for table, marked in found:
            add_counts(sums, table, count(table.count_marked(marked)))
            keep_earliest(first, table, marked)
        for clip, number in sums.items():
            node, time_s = first[clip]
            yield self.in_clip(clip, number, time_s=time_s, node=node)

    def at_rotation_steps(
        self, counts: Mapping[int, int], interpolation: Interpolation, is_fault: Callable[[Floats], Bools]
    ) -> Iterator[Occurrence]:
        """Yield an occurrence for each clip with a count above 0, at its first step that is a fault.

        counts: by index of the clip. is_fault: a mask (S,) from the dot products (S,) of keys with those before them.
        """
        clips = [number for number, count in counts.items() if count]
        if not clips:
            return
        rotations = self._tracks_by_path.get("rotation", ())
        chosen = [each for each in rotations if counts.get(each[0]) and each[1].interpolation is interpolation]
        at: dict[int, tuple[int, float]] = {}
        for table in track_tables(chosen, "rotation"):
            marked = table.inner_steps()
            marked[1:] &= is_fault(quaternion.dot(table.values[1:], table.values[:-1]))
            keep_earliest(at, table, marked)
        for number in clips:
            node, time_s = at.get(number, (None, None))  # without one: tracks of pointers
            yield self.in_clip(number, counts[number], time_s=time_s, node=node)

    @cached_property
    def clips(self) -> list[tuple[ClipReport, Clip]]:
        """The chosen, readable clips that have tracks, with their reports."""
        clips = [(report, self.contents.clips[report.index]) for report in self.facts.clips]
        return [each for each in clips if each[1].tracks]

    @cached_property
    def missing_frames(self) -> dict[int, EndFrame]:
        """Last frames of loops that are missing, by index of the clip."""
        return self._end_frames(EndFrameKind.MISSING)

    @cached_property
    def duplicate_frames(self) -> dict[int, EndFrame]:
        """Last frames of loops that are duplicate, by index of the clip."""
        return self._end_frames(EndFrameKind.DUPLICATE)

    def _end_frames(self, kind: EndFrameKind) -> dict[int, EndFrame]:
        first = first_equal([(clip,) for _, clip in self.clips])
        distinct = [self.clips[n] for n in sorted(set(first))]
        roots = [root_motion_node(self.skeleton, clip) for _, clip in distinct]
        gaps = [report.seam_m for report, _ in distinct]
        found = find_end_frames(self.motion, [clip for _, clip in distinct], roots, gaps, (kind,))
        frames = {report.index: frame for (report, _), frame in zip(distinct, found, strict=True)}
        numbers = ((report.index, self.clips[first[n]][0].index) for n, (report, _) in enumerate(self.clips))
        return {number: frame for number, equal in numbers if (frame := frames[equal]) is not None}

    def in_clip(
        self,
        number: int,
        count: int = 1,
        value: float = 0.0,
        *,
        problem: str = "",
        time_s: float | None = None,
        node: int | None = None,
    ) -> Occurrence:
        """Return an occurrence in a clip by its index."""
        name = self.contents.clips[number].name
        label = reader.clip_label(name, number)
        return Occurrence(
            label, f"/animations/{number}", count, value, problem, number=number, name=name, time_s=time_s, node=node
        )

    def in_node(self, number: int, count: int = 1, value: float = 0.0, *, problem: str = "") -> Occurrence:
        """Return an occurrence in a node by its index."""
        name = self.skeleton.names[number]
        return Occurrence(
            node_label(self.json, number), f"/nodes/{number}", count, value, problem, number=number, name=name
        )

    def in_skin(self, number: int, count: int = 1, value: float = 0.0, *, problem: str = "") -> Occurrence:
        """Return an occurrence in a skin by its index."""
        name = self.json["skins"][number].get("name", "")
        label = reader.clip_label(name, number, "skin")
        return Occurrence(label, f"/skins/{number}", count, value, problem, number=number, name=name)
