"""Report of `inspect` on a file, its clips, tracks and skins: numbers with units in their names."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from anim.errors import AnimError


class TrackReport(NamedTuple):
    """One track: its target, keys, and statistics (see `track_statistics`)."""

    target: str
    path: str
    interpolation: str
    keys: int
    start_s: float
    end_s: float
    constant: bool
    no_effect: bool
    redundant_keys: int
    non_unit_keys: int
    sign_flips: int
    wide_steps: int
    widest_step_rad: float


@dataclass(frozen=True, slots=True)
class ClipReport:
    """One clip. duration_s: from the first to the last key; players count from 0 to end_s.

    frame_rate_fps, frame_rate_regular: the estimate, and the fraction of keys on its grid; None for too few keys.
    data_bytes, stored_bytes, json_bytes: size of its values decoded, its part of them as stored (compressed or not),
    and its JSON; share: fraction of the file that the last two take. Data shared by clips counts in each.
    repeating_tracks: constant tracks with several keys that neither equal the rest pose nor define the clip's end.
    sign_flips_in_splines: those of sign_flips that are on CUBICSPLINE tracks.
    root_*: motion of the root. seam_m, seam_speed_m_per_s: loop gap and velocity gap without root motion;
    seam_measured_on: "skin", or "nodes" if no vertices can be read.
    """

    index: int
    name: str
    start_s: float
    end_s: float
    duration_s: float
    tracks: dict[str, int]
    interpolations: dict[str, int]
    keys: int
    frame_rate_fps: float | None
    frame_rate_regular: float | None
    data_bytes: int
    stored_bytes: int
    json_bytes: int
    share: float
    constant_tracks: int
    no_effect_tracks: int
    repeating_tracks: int
    redundant_keys: int
    non_unit_rotations: int
    sign_flips: int
    sign_flips_in_splines: int
    wide_steps: int
    widest_step_rad: float
    seam_m: float
    seam_speed_m_per_s: float
    seam_measured_on: str
    root: str
    root_distance_m: float
    root_speed_m_per_s: float
    track_list: tuple[TrackReport, ...] = field(default=(), repr=False)


@dataclass(frozen=True, slots=True)
class SkinReport:
    """One skin with the meshes that use it; None for values of unreadable vertices.

    unused_joints: joints that influence no vertex, and none of whose descendants does. most_influences: of any vertex.
    off_sums: number of vertices with weights that do not add up to 1; worst_sum_error: the largest deviation.
    """

    index: int
    name: str
    joints: int
    vertices: int | None
    unused_joints: int | None
    most_influences: int | None
    mean_influences: float | None
    off_sums: int | None
    worst_sum_error: float | None


class Facts(NamedTuple):
    """Report on a file.

    animation_*_bytes: values decoded, values as stored, and JSON; data shared by clips counts once.
    faults: reasons for which other commands refuse the file; the parts concerned are absent from the report.
    unreadable_clips: number of clips that are among those parts.
    """

    generator: str
    extensions_used: tuple[str, ...]
    nodes: int
    meshes: int
    vertices: int | None
    animation_data_bytes: int
    animation_stored_bytes: int
    animation_json_bytes: int
    clips: tuple[ClipReport, ...]
    skins: tuple[SkinReport, ...]
    faults: tuple[AnimError, ...] = ()
    unreadable_clips: int = 0
