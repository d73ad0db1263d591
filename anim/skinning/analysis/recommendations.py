"""Recommendations against skin collapse: text, and command lines if a command helps.

IN and OUT are placeholders for the files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from anim.gltf.reading.reader import choose_option
from anim.skinning.analysis.collapse import LOW_INDEX, MeshCollapse
from anim.skinning.analysis.collapsed_clips import MIN_VOLUME_FRACTION, is_collapsed, linear_volume
from anim.skinning.analysis.method_scores import MethodScore
from anim.skinning.analysis.ranking import SAME_VOLUME_FRACTION, RankedMethod, best_method, rank_methods
from anim.skinning.methods.registry import SKINNING_METHODS

TWIST_RADIUS_FRACTION = 0.95  # of a ring's radius, kept by twist joints
MIN_VISIBLE_BULGE = 1.25  # times the distance from the bones at rest
MIN_BULGE_INCREASE = 0.1  # above linear blending: else the motion causes it
CLAMP_OPTION = " --bulge-clamp"  # for methods other than lbs, the same in both commands
MIN_BULGING_FRACTION = 0.01  # of the vertices, for a recommendation


@dataclass(frozen=True, slots=True)
class CollapseFinding:
    """A mesh in a clip, with the clip's index and name."""

    number: int
    clip: str
    mesh: MeshCollapse


def recommend(found: Sequence[CollapseFinding], *, clamped: bool = False) -> Iterator[str]:
    """Yield recommendations, a line each, the worst clip first; one line without a collapse or a clip.

    Measured methods are recommended by their scores, others only for measurement. clamped: whether methods other than
    lbs were measured with the bulge clamp.
    """
    yield from _unusable(found)
    collapsed = sorted((each for each in found if is_collapsed(each.mesh)), key=lambda each: each.mesh.worst.index)
    if collapsed:
        yield from _against_collapse(collapsed, clamped=clamped)
    elif found:
        yield _all_is_well(found, clamped=clamped)
    else:
        yield "there is no clip to look at"


def _unusable(found: Sequence[CollapseFinding]) -> Iterator[str]:
    """The largest deviation of each method that exceeds the model's size."""
    lost = [(fared.max_distance, fared, each) for each in found for fared in each.mesh.methods if fared.unusable]
    for method in dict.fromkeys(fared.method for _, fared, _ in lost):
        off, fared, each = max((one for one in lost if one[1].method == method), key=lambda one: one[0])
        yield (
            f"{method} can't be used: a vertex is {off:.3g} m from where linear blending has it, more than the model's "
            f"size ('{each.clip}', {fared.max_distance_time:.2f} s)"
        )


def twist_joints(angle: float) -> int:
    """Return the number of joints for a twist by `angle` rad with 95 % of the radius at each: cos(θ / 2n).

    twist_joints(π / 2) → 3
    """
    return max(1, math.ceil(angle / (2 * math.acos(TWIST_RADIUS_FRACTION)) - 1e-9))


def _all_is_well(found: Sequence[CollapseFinding], *, clamped: bool) -> str:
    meshes = [each.mesh for each in found]
    index = min(each.worst.index for each in meshes)
    summary = f"no index is below {LOW_INDEX} (min {index:.3f})"
    left = _remaining_collapse(meshes)
    if left is not None and left < MIN_VOLUME_FRACTION:
        return f"{summary}; {_percent(left)} of the volume remains at worst, and no method that was measured keeps more"
    if left is not None:
        return f"linear blending is good enough: {summary}, {_percent(left)} or more of the volume remains"
    if any(each.closed for each in meshes):
        line = _collapse_command(found, ["lbs"], clamped=clamped)
        return f"{summary}; to measure the volume with linear blending: {line}"
    return f"linear blending is good enough: {summary}"


def _remaining_collapse(meshes: list[MeshCollapse]) -> float | None:
    """The smallest volume by linear blending, relative to bind pose."""
    volumes = [volume for each in meshes if (volume := linear_volume(each)) is not None]
    return min((float(each.min()) for each in volumes), default=None)


def _against_collapse(collapsed: list[CollapseFinding], *, clamped: bool) -> Iterator[str]:
    yield _worst(collapsed)
    found = rank_methods([each.mesh for each in collapsed])
    chosen = best_method(found)
    worse = chosen is not None and _keeps_less(found, chosen)
    yield _no_gain(found) if worse else _bake(found, chosen, collapsed, clamped=clamped)
    yield from _distribute_twist(collapsed)
    if chosen is not None and not worse:
        yield from _against_bulging(collapsed, chosen.method, clamped=clamped)


def _worst(collapsed: list[CollapseFinding]) -> str:
    first, clips = collapsed[0], len({each.number for each in collapsed})
    worst, left = first.mesh.worst, _remaining_collapse([first.mesh])
    summary = "1 clip collapses" if clips == 1 else f"{clips} clips collapse"
    places = f"'{worst.joint}' against '{worst.other}', {math.degrees(worst.angle):.0f}° at {worst.time:.2f} s"
    loss = f"; {_percent(left)} of the volume remains" if left is not None and left < MIN_VOLUME_FRACTION else ""
    return f"{summary}; min index {worst.index:.2f} in '{first.clip}': {places}{loss}"


def _bake(
    found: Sequence[RankedMethod], chosen: RankedMethod | None, collapsed: list[CollapseFinding], *, clamped: bool
) -> str:
    if chosen is None and any(each.unusable for each in found):
        return "no other method that was measured can be used"
    if chosen is None:
        others = _unmeasured(collapsed)
        line = _collapse_command(collapsed, others, clamped=False)
        return f"bake with another method; to compare first with {' and '.join(others)}: {line}"
    numbers = _numbers(collapsed)
    clips, output = choose_option(numbers), "OUT" if len(numbers) == 1 else "'OUT-{clip}.glb'"
    keeps = f" ({_keeps(found)} of the volume)" if chosen.volume is not None else ""
    method = f"--method {chosen.method}{CLAMP_OPTION if clamped else ''}"
    return f"to bake with {chosen.method}{keeps}: gltf-anim bake IN {output} {method}{clips}"


def _no_gain(found: Sequence[RankedMethod]) -> str:
    return f"no other method that was measured keeps more of the volume than lbs ({_keeps(found)})"


def _keeps_less(found: Sequence[RankedMethod], chosen: RankedMethod) -> bool:
    """Return whether even the best method loses volume that linear blending keeps."""
    linear = next((each.volume for each in found if each.method == "lbs"), None)
    return linear is not None and chosen.volume is not None and chosen.volume + SAME_VOLUME_FRACTION < min(linear, 1.0)


def _keeps(found: Sequence[RankedMethod]) -> str:
    return ", ".join(
        f"{each.method} keeps {_percent(each.volume)}"
        for each in found
        if each.volume is not None and not each.unusable
    )


def _distribute_twist(collapsed: list[CollapseFinding]) -> Iterator[str]:
    """The worst twist, if any; twist joints don't help bends."""
    worst = next((each.mesh.worst for each in collapsed if each.mesh.worst.twist), None)
    if worst is not None and (count := twist_joints(worst.angle)) > 1:
        yield (
            f"or distribute the twist over {count} joints between '{worst.joint}' and '{worst.other}' "
            f"({_percent(math.cos(worst.angle / (2 * count)))} of the radius remains), for all players"
        )


def _against_bulging(collapsed: list[CollapseFinding], method: str, *, clamped: bool) -> Iterator[str]:
    swollen: list[tuple[MethodScore, CollapseFinding]] = []
    for each in collapsed:
        linear = max((fared.bulge for fared in each.mesh.methods if fared.method == "lbs"), default=1.0)
        swollen += [(fared, each) for fared in each.mesh.methods if fared.method == method and _swells(fared, linear)]
    if swollen:
        fared, each = max(swollen, key=lambda pair: pair[0].bulge)
        yield f"{method} bulges up to {fared.bulge:.2f}× at '{fared.joint}' ({each.clip}, {fared.time:.2f} s)"
        if not clamped:
            yield f"to compare with the bulge clamp: {_collapse_command([each], [], clamped=True)}"
        if others := _unmeasured([each]):
            names = " and ".join(others)
            yield f"to compare with {names}: {_collapse_command([each], others, clamped=clamped)}"


def _swells(fared: MethodScore, linear: float) -> bool:
    """Return whether a method bulges visibly, and more than linear blending."""
    return fared.bulge > max(MIN_VISIBLE_BULGE, linear + MIN_BULGE_INCREASE) and fared.bulging > MIN_BULGING_FRACTION


def _unmeasured(found: Sequence[CollapseFinding]) -> list[str]:
    """The methods without a score yet."""
    known = {"lbs", *(fared.method for each in found for fared in each.mesh.methods)}
    return [name for name in SKINNING_METHODS if name not in known]


def _collapse_command(found: Sequence[CollapseFinding], others: Sequence[str], *, clamped: bool) -> str:
    """The command line for these clips with the usable measured methods, and with others."""
    lost = {fared.method for each in found for fared in each.mesh.methods if fared.unusable}
    known = [fared.method for each in found for fared in each.mesh.methods if fared.method not in lost]
    methods = "".join(f" --method {name}" for name in dict.fromkeys([*known, *others]))
    return f"gltf-anim collapse IN{methods}{CLAMP_OPTION if clamped else ''}{choose_option(_numbers(found))}"


def _numbers(found: Sequence[CollapseFinding]) -> list[int]:
    """The clips' indices, each once."""
    return sorted({each.number for each in found})


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
