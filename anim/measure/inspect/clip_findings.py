"""Findings on clips and skins, from their reports, each with advice.

Advice is a command line with IN and OUT for the files, if one of the commands does it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass

from anim.gltf.reading import reader
from anim.measure.inspect.file_findings import Finding, Severity
from anim.measure.inspect.report import ClipReport, SkinReport

MAX_USUAL_INFLUENCES = 4  # influences per vertex that most players evaluate
MIN_REGULAR_FRACTION = 0.9  # fraction of keys on the grid below which a frame rate is not reliable
MIN_LATE_START_S = 5e-4  # s; starts below come from rounding, and no display shows them
MAX_IRREGULAR_FPS = 60.0  # advised where keys are on no frame grid; the spacing of the closest ones says little
DEFAULT_FPS = 60.0  # advised for clips without a frame rate of their own


def clip_findings(clips: Iterable[ClipReport]) -> Iterator[Finding]:
    """Yield one finding per kind of fault, with the clips that have it."""
    clips = list(clips)
    for rule in _CLIP_RULES:
        bad = [clip for clip in clips if rule.count(clip)]
        if bad:
            problem = rule.problem(bad, sum(map(rule.count, bad)))
            where = reader.clip_labels([(clip.name, clip.index) for clip in bad])
            chosen = choose_option([clip.index for clip in bad])
            advice = rule.advice.format(fps=_rate(bad), finer=2 * _rate(bad), clips=chosen)
            yield Finding(rule.name, rule.severity, where, problem, advice)


def choose_option(numbers: Collection[int]) -> str:
    """Return the options that select clips by index; "" if they are too many to list.

    choose_option([0, 2]) → " --clip '#0' --clip '#2'"
    """
    return "".join(f" --clip '#{number}'" for number in numbers) if len(numbers) <= reader.MAX_LISTED_CLIPS else ""


def skin_findings(skins: Iterable[SkinReport]) -> Iterator[Finding]:
    """Yield the findings on each skin."""
    for skin in skins:
        where = reader.clip_label(skin.name, skin.index, "skin")
        if skin.unused_joints:
            problem = f"{skin.unused_joints} of {skin.joints} joints move no vertex"
            advice = "if nothing is attached to them, leave them out where the skin is made"
            yield Finding("unused-joints", Severity.INFO, where, problem, advice)
        if skin.off_sums:
            problem = f"weights of {skin.off_sums} vertices do not add up to 1 (error up to {skin.worst_sum_error:.2g})"
            yield Finding("weight-sums", Severity.WARNING, where, problem, "normalize weights where the mesh is made")
        if skin.most_influences is not None and skin.most_influences > MAX_USUAL_INFLUENCES:
            problem = f"up to {skin.most_influences} influences per vertex"
            advice = "many players use the first four only: limit them where the mesh is made"
            yield Finding("many-influences", Severity.WARNING, where, problem, advice)


@dataclass(frozen=True, slots=True)
class _Rule:
    """Rule of a finding.

    count: number of faults in a clip. problem: text from the clips with the fault and their total count. advice: text
    with {fps} for the clips' frame rate, {finer} for twice that, {clips} for the options that select them.
    """

    name: str
    severity: Severity
    count: Callable[[ClipReport], int]
    problem: Callable[[list[ClipReport], int], str]
    advice: str


def _counted(one: str, many: str) -> Callable[[list[ClipReport], int], str]:
    return lambda _, count: f"{count} {one if count == 1 else many}"


def _late(clips: list[ClipReport], _: int) -> str:
    return f"first key at {_range([clip.start_s for clip in clips])} s: players hold the first pose until then"


def _irregular(clips: list[ClipReport], _: int) -> str:
    least = min(clip.frame_rate_regular or 0.0 for clip in clips)
    return f"only {math.floor(100 * least)} % of key times are on a frame grid"


def _range(seconds: list[float]) -> str:
    least, most = (f"{each:.4f}".rstrip("0").rstrip(".") for each in (min(seconds), max(seconds)))
    return least if least == most else f"{least} to {most}"


def _rate(clips: list[ClipReport]) -> int:
    """Smallest whole frame rate with a frame at every key of the clips, else DEFAULT_FPS."""
    return math.ceil(max(map(_clip_rate, clips)) - 1e-3)


def _clip_rate(clip: ClipReport) -> float:
    """Frame rate of a clip; of irregular keys at most MAX_IRREGULAR_FPS, however close some of them are."""
    fps = clip.frame_rate_fps or DEFAULT_FPS
    return fps if (clip.frame_rate_regular or 0.0) >= MIN_REGULAR_FRACTION else min(fps, MAX_IRREGULAR_FPS)


_CLIP_RULES: tuple[_Rule, ...] = (
    _Rule(
        "non-unit-rotations",
        Severity.WARNING,
        lambda clip: clip.non_unit_rotations,
        _counted("rotation key is not a unit quaternion", "rotation keys are not unit quaternions"),
        "normalize them where they are made, or: gltf-anim resample IN OUT --fps {fps}{clips}",
    ),
    _Rule(
        "wide-steps",
        Severity.WARNING,
        lambda clip: clip.wide_steps,
        _counted("rotation of 170° or more between keys", "rotations of 170° or more between keys"),
        "players may differ on the shorter arc; to add keys: gltf-anim resample IN OUT --fps {finer}{clips}",
    ),
    _Rule(
        "sign-flips",
        Severity.INFO,
        lambda clip: clip.sign_flips - clip.sign_flips_in_splines,
        _counted("quaternion sign change between keys", "quaternion sign changes between keys"),
        "harmless for slerp; for players that blend components: gltf-anim resample IN OUT --fps {fps}{clips}",
    ),
    _Rule(
        "sign-flips-in-splines",
        Severity.WARNING,
        lambda clip: clip.sign_flips_in_splines,
        _counted(
            "quaternion sign change between keys of a CUBICSPLINE track",
            "quaternion sign changes between keys of CUBICSPLINE tracks",
        ),
        "the spline takes the long arc there; to compute new tangents: gltf-anim spline IN OUT{clips}",
    ),
    _Rule(
        "no-effect-tracks",
        Severity.INFO,
        lambda clip: clip.no_effect_tracks - (clip.no_effect_tracks == sum(clip.tracks.values())),  # one stays
        _counted("track equals the rest pose", "tracks equal the rest pose"),
        "unless players blend clips: gltf-anim optimize IN OUT --drop rest",
    ),
    _Rule(
        "constant-tracks",
        Severity.INFO,
        lambda clip: clip.repeating_tracks,
        _counted("constant track has several keys", "constant tracks have several keys"),
        "one key is enough; to reduce them: gltf-anim optimize IN OUT",
    ),
    _Rule(
        "redundant-keys",
        Severity.INFO,
        lambda clip: clip.redundant_keys,
        _counted(
            "redundant key (interpolated exactly by its neighbors)",
            "redundant keys (interpolated exactly by their neighbors)",
        ),
        "to remove those that no vertex needs: gltf-anim optimize IN OUT",
    ),
    _Rule(
        "late-start",
        Severity.INFO,
        lambda clip: clip.start_s > MIN_LATE_START_S,
        _late,
        "if unintended: gltf-anim trim IN OUT --rebase",
    ),
    _Rule(
        "irregular-keys",
        Severity.INFO,
        lambda clip: clip.frame_rate_regular is not None and clip.frame_rate_regular < MIN_REGULAR_FRACTION,
        _irregular,
        "normal for sparse keys; for a grid: gltf-anim resample IN OUT --fps 30{clips}",
    ),
)
