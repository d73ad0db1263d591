"""Facts about clips and skins → findings: what a person should know, and do.

Where a command of ours does what is advised, its line is given, with IN and OUT for the files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass

from anim.gltf.reading import reader
from anim.measure.inspect.file_findings import Finding, Severity
from anim.measure.inspect.report import ClipReport, SkinReport

MANY_INFLUENCES = 4  # what most players evaluate per vertex
IRREGULAR = 0.9  # share of keys on the grid below which a rate is no rate
LATE_S = 5e-4  # a start nearer to 0 s is 0: what rounding leaves, and no display shows it
USUAL_FPS = 60.0  # the rate that is advised where clips have none of their own


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
    """Return the options that choose clips by their numbers, where they are few: else all clips.

    choosing([0, 2]) → " --clip '#0' --clip '#2'"
    """
    return "".join(f" --clip '#{number}'" for number in numbers) if len(numbers) <= reader.MAX_LISTED_CLIPS else ""


def skin_findings(skins: Iterable[SkinReport]) -> Iterator[Finding]:
    """Yield what is wrong with each skin."""
    for skin in skins:
        where = reader.clip_label(skin.name, skin.index, "skin")
        if skin.unused_joints:
            problem = f"{skin.unused_joints} of {skin.joints} joints move no vertex"
            advice = "unless something hangs on them, leave them out where the skin is made"
            yield Finding("unused-joints", Severity.INFO, where, problem, advice)
        if skin.off_sums:
            problem = f"weights of {skin.off_sums} vertices don't add up to 1, off by up to {skin.worst_sum_error:.2g}"
            yield Finding("weight-sums", Severity.WARNING, where, problem, "normalize weights where the mesh is made")
        if skin.most_influences is not None and skin.most_influences > MANY_INFLUENCES:
            problem = f"up to {skin.most_influences} influences per vertex"
            advice = "many players use the first four only: limit them where the mesh is made"
            yield Finding("many-influences", Severity.WARNING, where, problem, advice)


@dataclass(frozen=True, slots=True)
class _Rule:
    """count: how often a clip has the fault. problem: words on the clips that have it, and how often they do.

    advice: what to do; {fps} is the clips' own rate, {finer} twice that, {clips} chooses them where they are few.
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
    """Frames per second that put a key at every key of the clips, where those lie on a grid; else a usual rate."""
    rates = [clip.frame_rate_fps or USUAL_FPS for clip in clips]
    return math.ceil(max(rates) - 1e-3)


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
        lambda clip: clip.no_effect_tracks - (clip.no_effect_tracks == sum(clip.tracks.values())),  # one must stay
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
        lambda clip: clip.start_s > LATE_S,
        _late,
        "if unintended: gltf-anim trim IN OUT --rebase",
    ),
    _Rule(
        "irregular-keys",
        Severity.INFO,
        lambda clip: clip.frame_rate_regular is not None and clip.frame_rate_regular < IRREGULAR,
        _irregular,
        "normal for sparse keys; for a grid: gltf-anim resample IN OUT --fps 30{clips}",
    ),
)
