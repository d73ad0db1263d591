"""Selection of tracks for plots, their names, and matching tracks of a second file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.errors import NotFoundError
from anim.gltf.document import Document, json_array
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.measure.inspect import frame_rate
from anim.model import Clip, Interpolation, Skeleton, Track, ValueKind, parse_weight_pointer
from anim.operations.selection import Selection
from anim.show.plots import polylines
from anim.show.plots.figure import plain_text
from anim.show.plots.moving_tracks import are_moving
from anim.show.plots.polylines import Polyline
from anim.show.plots.rotations import COMPONENTS, FROM_REST, RotationCurve, rotation_curve

MAX_COLORED = 6  # components in color; the others are in the background
IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])
COLORS = ("color", "Color", "ColorFactor", "emissiveFactor", "attenuationColor")  # ends of pointers that name colors
MIN_FPS = 8.0  # fps; lower rates are intervals of single poses, not frames
MIN_GRID_FRACTION = 0.98  # least fraction of keys on a frame grid for showing frames


@dataclass(frozen=True, eq=False)
class PlotTrack:
    """One track to draw.

    clip, target: names. labels: of its components. start, end: of its clip, s. fps: of its clip, None if unknown.
    other: the matching track of a second file, or None. view: representation of a rotation: FROM_REST, COMPONENTS, or
    an order of Euler angles. rest: (4,) rotation of the node at rest.
    """

    clip: str
    target: str
    track: Track
    labels: tuple[str, ...]
    start: float
    end: float
    fps: float | None
    other: Track | None = None
    view: str = FROM_REST
    rest: Floats = field(default_factory=lambda: IDENTITY)

    @property
    def is_in_degrees(self) -> bool:
        """Return whether a rotation is drawn as angles, not as the components of its quaternion."""
        return self.track.kind is ValueKind.ROTATION and self.view != COMPONENTS

    @cached_property
    def curve(self) -> RotationCurve:
        """The track as drawn values."""
        return self._curve(self.track)

    @cached_property
    def other_curve(self) -> RotationCurve | None:
        """The track of the second file as drawn values."""
        return None if self.other is None else self._curve(self.other)

    @cached_property
    def colored(self) -> list[int]:
        """Indices of the components with the largest range."""
        ranges = np.ptp(self.curve.keys, axis=0)
        return sorted(np.argsort(-ranges, kind="stable")[:MAX_COLORED].tolist())

    @cached_property
    def speeds(self) -> list[Polyline]:
        """Speed of the track, and of that of the second file."""
        tracks = [self.track] if self.other is None else [self.track, self.other]
        return [polylines.keep_extremes(polylines.speed_line(track)) for track in tracks]

    def _curve(self, track: Track) -> RotationCurve:
        if self.is_in_degrees:
            curve = rotation_curve(track, view=self.view, rest=self.rest)
        else:
            risers = polylines.step_edges(track) if track.interpolation is Interpolation.STEP else None
            curve = RotationCurve(polylines.value_line(track), track.values, risers)
        return replace(curve, line=polylines.keep_extremes(curve.line))

    @property
    def key(self) -> tuple[str, str, str]:
        """Key by which tracks of two files are matched."""
        return self.clip, self.target, self.track.path


@dataclass(frozen=True, slots=True)
class TrackSelection:
    """Tracks to draw, in the file's order, and the numbers of omitted ones: constant, and above the limit."""

    shown: tuple[PlotTrack, ...]
    still: int = 0
    more: int = 0


def select_tracks(document: Document, selection: Selection, *, limit: int, view: str = FROM_REST) -> TrackSelection:
    """Return the selected moving tracks, at most `limit`; constant ones only if no track moves.

    view: representation of rotations; with an order of Euler angles only rotations are selected.
    Raises NotFoundError if no track is selected.
    """
    file = _ReadFile(document, view)
    found = file.select(selection)
    if view not in (FROM_REST, COMPONENTS):
        found = [each for each in found if each[1].kind is ValueKind.ROTATION]
    if not found:
        raise NotFoundError("no track is selected")
    moving = list(compress(found, are_moving([track for _, track in found]))) or found
    shown = tuple(file.plot_track(*each) for each in moving[:limit])
    return TrackSelection(shown, len(found) - len(moving), max(len(moving) - limit, 0))


def compare_selection(chosen: TrackSelection, other: Document) -> tuple[TrackSelection, int]:
    """Return the tracks with their matches in another file, and the number without a match.

    Raises NotFoundError if there is no match.
    """
    file = _ReadFile(other, FROM_REST)
    partners = {each.key: each for each in (file.plot_track(*found) for found in reversed(file.select(Selection())))}
    shown = tuple(_with(each, partners.get(each.key)) for each in chosen.shown)
    alone = sum(each.other is None for each in shown)
    if alone == len(shown):
        clips = sorted({each.clip for each in partners.values()})
        listed = ", ".join(f"'{name}'" for name in clips[:6])
        raise NotFoundError(
            "has none of the tracks to compare with (matched by clip, node and path)",
            help=f"its clips are {listed}{', …' if len(clips) > 6 else ''}" if clips else "it has no clips",
        )
    return replace(chosen, shown=shown), alone


def _with(each: PlotTrack, partner: PlotTrack | None) -> PlotTrack:
    if partner is None or partner.track.values.shape[1] != each.track.values.shape[1]:
        return each
    track = partner.track
    if track.kind is ValueKind.ROTATION and quaternion.dot(track.values[0], each.track.values[0]) < 0:
        track = _scale(track, np.full((len(track.times), 1), -1.0))
    return replace(
        each, other=track, start=min(each.start, partner.start), end=max(each.end, partner.end), fps=each.fps
    )


class _ReadFile:
    """Clips and skeleton of a file. view: representation of rotations."""

    def __init__(self, document: Document, view: str) -> None:
        self._clips, self._skeleton = reader.clips(document), reader.skeleton(document)
        self._targets = _morph_targets(document)
        self._view = view
        self._spans: dict[int, tuple[float, float, float | None]] = {}

    def select(self, selection: Selection) -> list[tuple[int, Track]]:
        """Return the selected tracks in the file's order, with the indices of their clips."""
        return [
            (number, self._clips[number].tracks[i])
            for number in selection.chosen_clips([clip.name for clip in self._clips])
            for i in sorted(selection.chosen_tracks(self._clips[number], self._skeleton))
        ]

    def plot_track(self, number: int, track: Track) -> PlotTrack:
        """Return a track of a clip, ready to be drawn."""
        clip = self._clips[number]
        if number not in self._spans:  # a search over all tracks of the clip
            self._spans[number] = clip.start, clip.end, _rate(clip)
        start, end, fps = self._spans[number]
        name = plain_text(reader.clip_name(clip.name, number))
        target = plain_text(_target(track, self._skeleton))
        rest = IDENTITY if track.node is None else self._skeleton.rotation[track.node]
        labels = _labels(track, self._targets, self._view)
        return PlotTrack(name, target, _align(track), labels, start, end, fps, None, self._view, rest)


def _align(track: Track) -> Track:
    """The track with aligned quaternion signs, so that curves jump only with the rotation.

    CUBICSPLINE is unchanged: there signs affect the interpolation.
    """
    if track.kind is not ValueKind.ROTATION or track.interpolation is Interpolation.CUBICSPLINE:
        return track
    signs = np.where(quaternion.dot(quaternion.align_signs(track.values), track.values) < 0, -1.0, 1.0)
    return track if (signs > 0).all() else _scale(track, signs[:, None])


def _scale(track: Track, signs: Floats) -> Track:
    before = None if track.in_tangents is None else track.in_tangents * signs
    after = None if track.out_tangents is None else track.out_tangents * signs
    return replace(track, values=track.values * signs, in_tangents=before, out_tangents=after)


def _rate(clip: Clip) -> float | None:
    estimated = frame_rate.estimate_frame_rate(clip.key_times)
    if estimated is None or estimated.regular < MIN_GRID_FRACTION or estimated.fps < MIN_FPS:
        return None
    return estimated.fps


def _target(track: Track, skeleton: Skeleton) -> str:
    if track.node is None:
        return track.pointer or ""
    return skeleton.display_name(track.node)


def _labels(track: Track, targets: Mapping[str, Sequence[str]], view: str) -> tuple[str, ...]:
    count = track.values.shape[1]
    if track.kind is ValueKind.ROTATION and view != COMPONENTS:
        return tuple("xyz") if view == FROM_REST else _euler_labels(view)
    if named := _weight_names(track, targets):
        return named
    if count in (3, 4) and track.pointer is not None and track.pointer.endswith(COLORS):
        return tuple("rgba"[:count])
    if count == 1:
        return ("",)
    return tuple("xyzw"[:count]) if count <= 4 else tuple(str(i) for i in range(count))


def _euler_labels(order: str) -> tuple[str, ...]:
    """Axes in their order, numbered if the first equals the third: ("Z", "X", "Y"), ("Z1", "X", "Z2")."""
    if order[0] != order[2]:
        return tuple(order)
    return f"{order[0]}1", order[1], f"{order[2]}2"


def _weight_names(track: Track, targets: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Names of morph weights, by the target's name or index; none for other tracks."""
    pointer = f"/nodes/{track.node}/weights" if track.path == "weights" else track.pointer or ""
    found = parse_weight_pointer(pointer)
    if found is None:
        return ()
    names, count = targets.get(f"/{found.owner}/{found.owner_index}/weights", ()), track.values.shape[1]
    if found.target is not None:
        if count > 1:  # of an invalid file: values of another width
            return ()
        return (plain_text(names[found.target]) if found.target < len(names) else f"target {found.target}",)
    if len(names) == count:
        return tuple(map(plain_text, _shorten(names)))
    return tuple(f"target {i}" for i in range(count))


def _morph_targets(document: Document) -> dict[str, tuple[str, ...]]:
    """Names of morph targets by the pointer to their weights, from `extras.targetNames` of meshes."""
    result: dict[str, tuple[str, ...]] = {}
    for i, mesh in enumerate(json_array(document.json, "meshes")):
        primitives = mesh["primitives"][:1]  # none in an invalid file, whose curves can be drawn nevertheless
        names = next(filter(None, map(_target_names, [mesh, *primitives])), ())
        if names:
            result[f"/meshes/{i}/weights"] = names
    for i, node in enumerate(json_array(document.json, "nodes")):
        pointer = f"/meshes/{node.get('mesh')}/weights"
        if pointer in result:
            result[f"/nodes/{i}/weights"] = result[pointer]
    return result


def _target_names(owner: Mapping[str, Any]) -> tuple[str, ...]:
    extras = owner.get("extras")
    names = extras.get("targetNames") if isinstance(extras, dict) else None
    return tuple(names) if isinstance(names, list) and all(isinstance(name, str) for name in names) else ()


def _shorten(names: Sequence[str]) -> tuple[str, ...]:
    """Names without their common prefix up to the last separator: "face_a", "face_b" → "a", "b"."""
    first, last = min(names), max(names)  # their common prefix is common to all
    same = next((i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), 0)
    cut = max(first[:same].rfind(mark) for mark in "_.-/ ") + 1
    short = [name[cut:] for name in names]
    return tuple(names) if any(not name or name.isdecimal() for name in short) else tuple(short)
