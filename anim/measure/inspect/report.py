"""What `inspect` finds out about a file, its clips, tracks and skins: plain numbers, units in their names."""

from __future__ import annotations

from dataclasses import dataclass, field

from anim.errors import AnimError
from anim.measure.inspect.file_findings import Finding


@dataclass(frozen=True, slots=True)
class TrackReport:
    """One track: what it moves, its keys, and what they tell (see `measure.tracks`)."""

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
    """One clip. duration_s: from its first to its last key; players count from 0 to end_s.

    frame_rate_fps, frame_rate_regular: the estimate and the share of keys on its grid; None where it is open.
    data_bytes, stored_bytes, json_bytes: its numbers decoded, its part of them as they are stored (compressed or not),
    and its JSON; share: the last two as a share of the file. What clips share counts in each.
    repeating_tracks: constant, of several keys, and neither at rest nor needed to hold the clip's end.
    sign_flips_in_splines: those of sign_flips that are on CUBICSPLINE tracks.
    root_*: the root's way. seam_m, seam_speed_m_per_s: from end to start, the way of a root that travels taken off;
    seam_measured_on: "skin", or "nodes" where no vertices can be read.
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
    """One skin on the meshes that use it; None where their vertices can't be read.

    unused_joints: neither carry a vertex nor have a joint below them that does. most_influences: of any vertex.
    off_sums: vertices whose weights don't sum to 1, and by how much at worst.
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


@dataclass(frozen=True, slots=True)
class Facts:
    """A whole file. animation_*_bytes: numbers decoded, as stored, and JSON; what clips share counts once.

    faults: for which commands refuse the file; what they concern is left out of the rest.
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
    findings: tuple[Finding, ...]
    faults: tuple[AnimError, ...] = ()
