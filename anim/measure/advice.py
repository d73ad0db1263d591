"""Facts about clips and skins → findings: what a person should know, and do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

from anim.measure.facts import ClipFacts, SkinFacts
from anim.measure.findings import Finding, Severity

MANY_INFLUENCES = 4  # what most players evaluate per vertex
IRREGULAR = 0.9  # share of keys on the grid below which a rate is no rate


def of_clips(clips: Iterable[ClipFacts]) -> Iterator[Finding]:
    """Yield one finding per kind of fault, with the clips that have it."""
    clips = list(clips)
    for name, severity, count, words, advice in _CLIP_RULES:
        counts = {_label(clip): count(clip) for clip in clips}
        bad = {label: number for label, number in counts.items() if number}
        if bad:
            yield Finding(name, severity, _listed(list(bad)), f"{sum(bad.values())} {words}", advice)
    for clip in clips:
        yield from _of_one(clip)


def of_skins(skins: Iterable[SkinFacts]) -> Iterator[Finding]:
    """Yield what is wrong with each skin."""
    for skin in skins:
        where = f"skin '{skin.name}'" if skin.name else f"skin {skin.index}"
        if skin.unused_joints:
            problem = f"{skin.unused_joints} of {skin.joints} joints move no vertex"
            yield Finding(
                "unused-joints", Severity.INFO, where, problem, "leave them out unless something hangs on them"
            )
        if skin.off_sums:
            problem = f"weights of {skin.off_sums} vertices sum up to {skin.worst_sum_error:.2g} off 1"
            yield Finding("weight-sums", Severity.WARNING, where, problem, "normalize weights where the mesh is made")
        if skin.most_influences is not None and skin.most_influences > MANY_INFLUENCES:
            problem = f"up to {skin.most_influences} influences per vertex"
            yield Finding("many-influences", Severity.WARNING, where, problem, "many players use the first four only")


_Rule = tuple[str, Severity, Callable[[ClipFacts], int], str, str]

_CLIP_RULES: tuple[_Rule, ...] = (
    (
        "non-unit-rotations",
        Severity.WARNING,
        lambda clip: clip.non_unit_rotations,
        "× a rotation key that is no unit quaternion",
        "resample, or normalize where they are made",
    ),
    (
        "wide-steps",
        Severity.WARNING,
        lambda clip: clip.wide_steps,
        "× a step of 170° or more from key to key",
        "put a key between: players differ on which way is shorter",
    ),
    (
        "sign-flips",
        Severity.INFO,
        lambda clip: clip.sign_flips if set(clip.interpolations) <= {"LINEAR", "STEP"} else 0,
        "× a quaternion that changes sign from key to key",
        "harmless for slerp; players that blend components spin: resample mends it",
    ),
    (
        "sign-flips-in-splines",
        Severity.WARNING,
        lambda clip: 0 if set(clip.interpolations) <= {"LINEAR", "STEP"} else clip.sign_flips,
        "× a quaternion that changes sign from key to key, in a clip with CUBICSPLINE",
        "a spline between them turns the wrong way: look at --tracks, and resample",
    ),
    (
        "no-effect-tracks",
        Severity.INFO,
        lambda clip: clip.no_effect_tracks,
        "× a track that holds a node where it rests anyway",
        "drop them, unless players blend this clip with others",
    ),
    (
        "constant-tracks",
        Severity.INFO,
        lambda clip: clip.constant_tracks - clip.no_effect_tracks,
        "× a track that never changes",
        "one key each says the same",
    ),
    (
        "redundant-keys",
        Severity.INFO,
        lambda clip: clip.redundant_keys,
        "× a key that its neighbors give anyway",
        "drop them: nothing moves",
    ),
)


def _of_one(clip: ClipFacts) -> Iterator[Finding]:
    where = _label(clip)
    if clip.start_s > 0:
        problem = f"first key at {clip.start_s:.3f} s: players hold the first pose until then"
        yield Finding("late-start", Severity.INFO, where, problem, "move the keys to 0 if that is not meant")
    regular = clip.frame_rate_regular
    if regular is not None and regular < IRREGULAR:
        problem = f"only {math.floor(100 * regular)} % of key times lie on a grid"
        yield Finding("irregular-keys", Severity.INFO, where, problem, "fine for sparse keys; else resample --fps")


def _label(clip: ClipFacts) -> str:
    return f"clip '{clip.name}'" if clip.name else f"clip {clip.index}"


def _listed(labels: list[str]) -> str:
    return ", ".join(labels[:3]) + (f" and {len(labels) - 3} more" if len(labels) > 3 else "")
