"""Inspection of a file: reports on clips, tracks and skins."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from functools import cache, partial

import numpy as np

from anim.arrays import Bools
from anim.gltf.document import Document, json_array
from anim.measure.equal_clips import first_equal
from anim.measure.inspect import frame_rate, root_motion, storage_cost
from anim.measure.inspect.contents import FileContents
from anim.measure.inspect.report import ClipReport, Facts, SkinReport, TrackReport
from anim.measure.inspect.stored_bytes import stored_bytes as stored
from anim.measure.inspect.track_statistics import TrackStats, stats
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.divided_ranges import measure_on_parts
from anim.measure.loops.seam import Seam, measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Interpolation, Scene, Skeleton, TimeAxis, Track
from anim.model.scene import MeshInstance
from anim.model.time_axis import merge_times
from anim.sampling.batch import ConcatenatedTracks, concatenate


def inspect(contents: FileContents, *, chosen: Iterable[int] | None = None, tracks: bool = False) -> Facts:
    """Return the report on a file.

    chosen: indices of the clips to report, None for all. tracks: report every track too.
    """
    document, skeleton, scene, clips = contents.document, contents.skeleton, contents.scene, contents.clips
    json = document.json
    numbers = [i for i in (clips if chosen is None else chosen) if i in clips]
    first = first_equal([(clips[i],) for i in numbers])
    looked_at = [clips[i] for n, i in enumerate(numbers) if first[n] == n]  # equal clips are measured once
    groups = concatenate([track for clip in looked_at for track in clip.tracks])
    counted = stats(groups, skeleton)
    ends = np.cumsum([0, *(len(clip.tracks) for clip in looked_at)])
    ways = root_motion.root_motions(skeleton, looked_at, figure=root_motion.figure_nodes(json, skeleton))
    seams = _seams(contents.motion, looked_at, groups)
    measured_on = "skin" if contents.motion.is_skin else "nodes"
    costs, cost = storage_cost.storage_costs(document)
    stored_bytes = min(stored(document), cost.data)
    packed = stored_bytes / cost.data if cost.data else 1.0
    counts = (counted.of_tracks(slice(ends[n], ends[n + 1])) for n in range(len(looked_at)))
    rate = cache(_frame_rate)  # by time axes, which clips often share
    measured = (
        _clip(clip, ways[n], seams[n], rate(clip.time_axes), measured_on, skeleton, next(counts), tracks=tracks)
        for n, clip in enumerate(looked_at)
    )
    reports: list[ClipReport] = []
    makers: list[partial[ClipReport]] = []
    for n, i in enumerate(numbers):
        makers.append(next(measured) if first[n] == n else makers[first[n]])
        reports.append(_with_costs(makers[n], i, clips[i].name, costs[i], packed, contents.file_bytes))
    skins = range(len(json_array(json, "skins")))
    using = _instances_by_skin(document, scene)
    return Facts(
        str(json["asset"].get("generator", "")),
        tuple(json.get("extensionsUsed", ())),
        len(skeleton),
        len(json_array(json, "meshes")),
        scene.vertex_count if scene is not None else None,
        cost.data,
        stored_bytes,
        cost.json,
        tuple(reports),
        tuple(_skin(i, document, scene, using.get(i, [])) for i in skins if i not in contents.lost_skins),
        contents.faults,
        contents.unreadable_clips,
    )


def _seams(skin: SkinMotion, clips: list[Clip], groups: list[ConcatenatedTracks]) -> list[Seam]:
    """Loop gaps of whole clips, measured like those of `loop`."""
    roots = (root_motion.root_motion_node(skin.skeleton, clip) for clip in clips)
    parts = [LoopRange(clip, clip.start, clip.end, root=root) for clip, root in zip(clips, roots, strict=True)]

    def measure(motion: SkinMotion, some: Sequence[LoopRange]) -> list[Seam]:
        return measure_seams(motion, some, groups if some is parts else None)

    return measure_on_parts(skin, parts, measure)


def _with_costs(
    make: partial[ClipReport], number: int, name: str, cost: storage_cost.StorageCost, packed: float, file_bytes: int
) -> ClipReport:
    """The report of a clip under its own index and name, with its own bytes."""
    stored_bytes = round(packed * cost.data)
    return make(
        index=number,
        name=name,
        data_bytes=cost.data,
        stored_bytes=stored_bytes,
        json_bytes=cost.json,
        share=(stored_bytes + cost.json) / file_bytes if file_bytes else 0.0,
    )


def _clip(
    clip: Clip,
    way: root_motion.RootMotion,
    seam: Seam,
    estimated: frame_rate.FrameRate | None,
    measured_on: str,
    skeleton: Skeleton,
    counted: TrackStats,
    *,
    tracks: bool,
) -> partial[ClipReport]:
    """The report of clips with these tracks, still to be called with the index, name and bytes of each."""
    start, end = clip.start, clip.end
    counted = _with_end(clip, counted)
    splines = np.array([track.interpolation is Interpolation.CUBICSPLINE for track in clip.tracks], np.bool_)
    keys = np.array([len(track.values) for track in clip.tracks], np.int64)
    interpolations = Counter([track.interpolation for track in clip.tracks])
    return partial(
        ClipReport,
        start_s=start,
        end_s=end,
        duration_s=end - start,
        tracks=dict(Counter([track.path for track in clip.tracks])),
        interpolations={str(name): count for name, count in interpolations.items()},
        keys=int(keys.sum()),
        frame_rate_fps=estimated.fps if estimated else None,
        frame_rate_regular=estimated.regular if estimated else None,
        constant_tracks=int(counted.constant.sum()),
        no_effect_tracks=int(counted.no_effect.sum()),
        repeating_tracks=_repeating(counted, keys > np.where(splines, 2, 1), has_end=end > start),
        redundant_keys=int(counted.redundant.sum()),
        non_unit_rotations=int(counted.non_unit.sum()),
        sign_flips=int(counted.flips.sum()),
        sign_flips_in_splines=int(counted.flips[splines].sum()),
        wide_steps=int(counted.wide.sum()),
        widest_step_rad=float(counted.widest.max(initial=0.0)),
        seam_m=seam.gap,
        seam_speed_m_per_s=seam.speed,
        seam_measured_on=measured_on,
        root=skeleton.display_name(way.root) if way.root >= 0 else "",
        root_distance_m=way.distance,
        root_speed_m_per_s=way.speed,
        track_list=tuple(_track(track, skeleton, counted, i) for i, track in enumerate(clip.tracks if tracks else ())),
    )


def _frame_rate(axes: tuple[TimeAxis, ...]) -> frame_rate.FrameRate | None:
    return frame_rate.estimate_frame_rate(merge_times(axes))


def _with_end(clip: Clip, counted: TrackStats) -> TrackStats:
    """The statistics, without a redundant key at the clip's end if only constant tracks have one there."""
    end = clip.end  # computed once: it is a search over all tracks
    last = {axis for axis in clip.time_axes if axis.times[-1] == end}
    at_end = [i for i, track in enumerate(clip.tracks) if track.time_axis in last]
    if end <= clip.start or not all(counted.constant[i] and counted.redundant[i] for i in at_end):
        return counted
    redundant = counted.redundant.copy()
    redundant[min(at_end, key=lambda i: redundant[i])] -= 1
    return counted._replace(redundant=redundant)


def _repeating(counted: TrackStats, several: Bools, *, has_end: bool) -> int:
    """Number of constant tracks with unneeded keys.

    several: tracks with more keys than a constant needs: one, of splines two. has_end: whether the clip has a duration.
    If no other track has a key at the clip's end, one of them is needed.
    """
    count = int((counted.constant & ~counted.no_effect & several).sum())
    return max(count - 1, 0) if counted.constant.all() and has_end else count


def _track(track: Track, skeleton: Skeleton, facts: TrackStats, i: int) -> TrackReport:
    target = track.pointer if track.node is None else skeleton.display_name(track.node)
    return TrackReport(
        target or "",
        track.path,
        str(track.interpolation),
        len(track.times),
        float(track.times[0]),
        float(track.times[-1]),
        bool(facts.constant[i]),
        bool(facts.no_effect[i]),
        int(facts.redundant[i]),
        int(facts.non_unit[i]),
        int(facts.flips[i]),
        int(facts.wide[i]),
        float(facts.widest[i]),
    )


def _instances_by_skin(document: Document, scene: Scene | None) -> dict[int, list[MeshInstance]]:
    nodes = json_array(document.json, "nodes")
    found: dict[int, list[MeshInstance]] = {}
    for instance in scene.instances if scene is not None else ():
        if "skin" in nodes[instance.node]:
            found.setdefault(nodes[instance.node]["skin"], []).append(instance)
    return found


def _skin(number: int, document: Document, scene: Scene | None, using: Sequence[MeshInstance]) -> SkinReport:
    about = json_array(document.json, "skins")[number]
    name, joints = about.get("name", ""), about["joints"]
    if scene is None or not using:
        return SkinReport(number, name, len(joints), None if scene is None else 0, None, None, None, None, None)
    counts = np.concatenate([(i.mesh.weights > 0).sum(axis=1) for i in using])
    uses = np.concatenate([i.mesh.count_uses() for i in using])
    off = [np.zeros(len(i.mesh.positions)) if (s := i.mesh.weight_sums) is None else np.abs(s - 1) for i in using]
    sums = np.concatenate(off)
    unused = len(joints) - len(useful_joints(using, joints, scene.skeleton))
    return SkinReport(
        number,
        name,
        len(joints),
        int(uses.sum()),
        unused,
        int(counts.max(initial=0)),
        float((uses * counts).sum() / uses.sum()) if len(counts) else 0.0,
        int(uses[sums > 0].sum()),
        float(sums.max(initial=0.0)),
    )


def useful_joints(instances: Sequence[MeshInstance], joints: Sequence[int], skeleton: Skeleton) -> set[int]:
    """Return the joints of a skin that influence a vertex, and their ancestors. instances: of its meshes."""
    useful: set[int] = set()
    for instance in instances:
        carrying = set(instance.mesh.joints[instance.mesh.weights > 0].tolist())
        for node in (joints[j] for j in sorted(carrying)):
            while node >= 0 and node not in useful:
                useful.add(node)
                node = int(skeleton.parents[node])
    return useful & set(joints)
