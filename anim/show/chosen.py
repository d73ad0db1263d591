"""Which tracks a picture shows, what they are called, and their partners in a second file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats, sorted_unique
from anim.errors import NotFoundError
from anim.gltf import read
from anim.gltf.document import Document, items
from anim.maths import quaternion
from anim.measure import rate
from anim.model import Clip, Interpolation, Kind, Skeleton, Track
from anim.ops.selection import Selection

STILL = 2e-5  # of the largest value; what moves less than this is rounding of the exporter
COLORS = ("color", "Color", "ColorFactor", "emissiveFactor", "attenuationColor")  # ends of pointers that name colors
SLOWEST = 8.0  # fps; fewer are the distances of a few poses and no frames
REGULAR = 0.98  # share of keys on a rate's grid from which on frames are worth showing


@dataclass(frozen=True, slots=True)
class Shown:
    """One track to draw.

    clip, target: names. labels: of its components. start, end: of its clip, s. fps: of its clip, None where unknown.
    other: the same track in a second file, if there is one to compare.
    """

    clip: str
    target: str
    track: Track
    labels: tuple[str, ...]
    start: float
    end: float
    fps: float | None
    other: Track | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        """What tracks of two files are matched by."""
        return self.clip, self.target, self.track.path


@dataclass(frozen=True, slots=True)
class Chosen:
    """Tracks to draw, in the file's order, and how many more were meant: still ones, and those above the limit."""

    shown: tuple[Shown, ...]
    still: int = 0
    more: int = 0


def choose(document: Document, selection: Selection, *, limit: int) -> Chosen:
    """Return the selected tracks that move, at most `limit`; still ones only where nothing else is meant.

    Raises NotFoundError where no track is selected.
    """
    found = _selected(document, selection)
    if not found:
        raise NotFoundError("no track is selected", help="see them with: gltf-anim inspect --tracks")
    moving = [each for each in found if _moves(each.track)] or found
    return Chosen(tuple(moving[:limit]), len(found) - len(moving), max(len(moving) - limit, 0))


def compare(chosen: Chosen, other: Document) -> tuple[Chosen, int]:
    """Return the tracks with their partners in another file, by clip, node and path, and how many have none.

    Raises NotFoundError where none has.
    """
    partners = {each.key: each for each in reversed(_selected(other, Selection()))}
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


def _with(each: Shown, partner: Shown | None) -> Shown:
    if partner is None or partner.track.values.shape[1] != each.track.values.shape[1]:
        return each
    track = partner.track
    if track.kind is Kind.ROTATION and quaternion.dot(track.values[0], each.track.values[0]) < 0:
        track = _scaled(track, np.full((len(track.times), 1), -1.0))
    return replace(
        each, other=track, start=min(each.start, partner.start), end=max(each.end, partner.end), fps=each.fps
    )


def _selected(document: Document, selection: Selection) -> list[Shown]:
    clips, skeleton = read.clips(document), read.skeleton(document)
    targets = _morph_targets(document)
    found = []
    for number in selection.chosen_clips([clip.name for clip in clips]):
        clip = clips[number]
        fps = _rate(clip)
        for i in sorted(selection.chosen_tracks(clip, skeleton)):
            track = _aligned(clip.tracks[i])
            labels = _labels(track, targets)
            name = _shown(clip.name or f"clip {number}")
            found.append(Shown(name, _shown(_target(track, skeleton)), track, labels, clip.start, clip.end, fps))
    return found


def _aligned(track: Track) -> Track:
    """The track with the signs of its quaternions such that curves don't jump where the rotation doesn't.

    CUBICSPLINE stays: there a sign is part of the way.
    """
    if track.kind is not Kind.ROTATION or track.interpolation is Interpolation.CUBICSPLINE:
        return track
    signs = np.where(quaternion.dot(quaternion.align_signs(track.values), track.values) < 0, -1.0, 1.0)
    return track if (signs > 0).all() else _scaled(track, signs[:, None])


def _scaled(track: Track, signs: Floats) -> Track:
    before = None if track.in_tangents is None else track.in_tangents * signs
    after = None if track.out_tangents is None else track.out_tangents * signs
    return replace(track, values=track.values * signs, in_tangents=before, out_tangents=after)


def _rate(clip: Clip) -> float | None:
    estimated = rate.estimate(sorted_unique(np.concatenate(clip.axes))) if clip.axes else None
    if estimated is None or estimated.regular < REGULAR or estimated.fps < SLOWEST:
        return None
    return estimated.fps


def _target(track: Track, skeleton: Skeleton) -> str:
    if track.node is None:
        return track.pointer or ""
    return skeleton.names[track.node] or f"node {track.node}"


def _labels(track: Track, targets: Mapping[int, Sequence[str]]) -> tuple[str, ...]:
    count = track.values.shape[1]
    if track.path == "weights" and track.node is not None:
        names = targets.get(track.node, ())
        if len(names) == count:
            return _shortened([_shown(name) for name in names])
        return tuple(str(i) for i in range(count))
    if count in (3, 4) and track.pointer is not None and track.pointer.endswith(COLORS):
        return tuple("rgba"[:count])
    if count == 1:
        return ("",)
    return tuple("xyzw"[:count]) if count <= 4 else tuple(str(i) for i in range(count))


def _morph_targets(document: Document) -> dict[int, tuple[str, ...]]:
    """Names of the morph targets by node, where the mesh has any in `extras.targetNames`, as exporters write them."""
    meshes = items(document.json, "meshes")
    result = {}
    for i, node in enumerate(items(document.json, "nodes")):
        extras = meshes[node["mesh"]].get("extras") if "mesh" in node else None
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if isinstance(names, list) and all(isinstance(name, str) for name in names):
            result[i] = tuple(names)
    return result


def _shown(name: str) -> str:
    """A name as a picture can hold it: XML has no place for control characters."""
    return "".join(c if c.isprintable() else "�" for c in name)


def _shortened(names: Sequence[str]) -> tuple[str, ...]:
    """Names without what all of them begin with, up to the last separator: "face_a", "face_b" → "a", "b"."""
    first, last = min(names), max(names)  # what these two share, all share
    same = next((i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), 0)
    cut = max(first[:same].rfind(mark) for mark in "_.-/ ") + 1
    return tuple(name[cut:] or name for name in names)


def _moves(track: Track) -> bool:
    values = track.values
    tangents = (track.in_tangents, track.out_tangents)
    tolerance = STILL * (1 if track.kind is Kind.ROTATION else max(float(np.abs(values).max()), 1e-30))
    return bool((np.abs(values - values[0]) > tolerance).any()) or any(
        each is not None and len(values) > 1 and bool(np.abs(each).max() > tolerance) for each in tangents
    )
