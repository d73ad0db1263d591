"""What to do about skin that collapses, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from anim.skinning.collapse import LOW, MeshCollapse
from anim.skinning.fared import Fared
from anim.skinning.methods import SKINNING_METHODS
from anim.skinning.pinching import KEPT, linear_volume, pinches
from anim.skinning.standings import ALIKE, Standing, best, standings

GOOD = 0.95  # of a ring's radius: what twist joints should leave
MUCH = 1.25  # times the distance from the links of its joints at rest: a bulge that is seen
MORE = 0.1  # than linear blending: else it is the motion that does it
SOME = 0.01  # share of vertices that has to bulge to be worth a word


@dataclass(frozen=True, slots=True)
class Found:
    """A mesh in a clip, by the clip's number and name."""

    number: int
    clip: str
    mesh: MeshCollapse


def advice(found: Sequence[Found], *, clamped: bool = False) -> Iterator[str]:
    """Yield what to do, a line each, the worst of all first; one line that all is well, or that there is no clip.

    Methods that were measured are recommended by what they did, others only to be measured. clamped: whether methods
    other than lbs were measured with the bulge clamp.
    """
    pinched = sorted((each for each in found if pinches(each.mesh)), key=lambda each: each.mesh.worst.index)
    if pinched:
        yield from _against_pinching(pinched, clamped=clamped)
    elif found:
        yield _all_is_well([each.mesh for each in found])
    else:
        yield "there is no clip to look at"


def twist_joints(angle: float) -> int:
    """Return how many joints must share a twist by `angle` rad so that each leaves 95 % of the radius: cos(θ / 2n).

    twist_joints(π / 2) → 3
    """
    return max(1, math.ceil(angle / (2 * math.acos(GOOD)) - 1e-9))


def _all_is_well(meshes: list[MeshCollapse]) -> str:
    index = min(each.worst.index for each in meshes)
    told = f"no vertex falls below {LOW} (least {index:.3f})"
    left = _left(meshes)
    if left is not None and left < KEPT:
        return f"{told}; {_percent(left)} of the volume is left at worst, and no method that was measured keeps more"
    if left is not None:
        return f"linear blending is good enough: {told}, {_percent(left)} or more of the volume is left"
    if any(each.closed for each in meshes):
        return f"{told}; add --method lbs to see what linear blending leaves of the volume"
    return f"linear blending is good enough: {told}"


def _left(meshes: list[MeshCollapse]) -> float | None:
    """The least volume of all by linear blending, against bind pose."""
    volumes = [volume for each in meshes if (volume := linear_volume(each)) is not None]
    return min((float(each.min()) for each in volumes), default=None)


def _against_pinching(pinched: list[Found], *, clamped: bool) -> Iterator[str]:
    yield _worst(pinched)
    found = standings([each.mesh for each in pinched])
    chosen = best(found)
    worse = chosen is not None and _keeps_less(found, chosen)
    yield _no_gain(found) if worse else _bake(found, chosen, clamped=clamped)
    yield from _sharing_the_twist(pinched)
    if chosen is not None and not worse:
        yield from _against_bulging(pinched, chosen.method, clamped=clamped)


def _worst(pinched: list[Found]) -> str:
    first, clips = pinched[0], len({each.number for each in pinched})
    worst, left = first.mesh.worst, _left([first.mesh])
    told = "1 clip pinches" if clips == 1 else f"{clips} clips pinch"
    places = f"'{worst.joint}' against '{worst.other}', {math.degrees(worst.angle):.0f}° at {worst.time:.2f} s"
    loss = f"; {_percent(left)} of the volume is left" if left is not None and left < KEPT else ""
    return f"{told}; worst {worst.index:.2f} in '{first.clip}': {places}{loss}"


def _bake(found: Sequence[Standing], chosen: Standing | None, *, clamped: bool) -> str:
    if chosen is None:
        return f"bake it with another method: see first what {_unmeasured(found, clamped=True)} makes of it"
    keeps = f" ({_keeps(found)} of the volume)" if chosen.volume is not None else ""
    return f"bake it with --method {chosen.method}{' --bulge-clamp' if clamped else ''}{keeps}"


def _no_gain(found: Sequence[Standing]) -> str:
    return f"no other method that was measured keeps more of the volume than lbs ({_keeps(found)})"


def _keeps_less(found: Sequence[Standing], chosen: Standing) -> bool:
    """Whether even the best method loses volume that linear blending keeps."""
    linear = next((each.volume for each in found if each.method == "lbs"), None)
    return linear is not None and chosen.volume is not None and chosen.volume + ALIKE < min(linear, 1.0)


def _keeps(found: Sequence[Standing]) -> str:
    return ", ".join(f"{each.method} keeps {_percent(each.volume)}" for each in found if each.volume is not None)


def _sharing_the_twist(pinched: list[Found]) -> Iterator[str]:
    """The worst twist, if any: bends have no use for twist joints."""
    worst = next((each.mesh.worst for each in pinched if each.mesh.worst.twist), None)
    if worst is not None and (count := twist_joints(worst.angle)) > 1:
        yield (
            f"or share the twist among {count} joints between '{worst.joint}' and '{worst.other}' "
            f"({_percent(math.cos(worst.angle / (2 * count)))} of the radius stays), which every player shows"
        )


def _against_bulging(pinched: list[Found], method: str, *, clamped: bool) -> Iterator[str]:
    swollen: list[tuple[Fared, Found]] = []
    for each in pinched:
        linear = max((fared.bulge for fared in each.mesh.methods if fared.method == "lbs"), default=1.0)
        swollen += [(fared, each) for fared in each.mesh.methods if fared.method == method and _swells(fared, linear)]
    if swollen:
        fared, each = max(swollen, key=lambda pair: pair[0].bulge)
        untried = _unmeasured(each.mesh.methods, clamped=clamped)
        yield f"{method} bulges up to {fared.bulge:.2f}× at '{fared.joint}' ({each.clip}, {fared.time:.2f} s): " + (
            f"look at it, and see what {untried} makes of it" if untried else "look at it"
        )


def _swells(fared: Fared, linear: float) -> bool:
    """Whether a method bulges so that it is seen, and more than linear blending does."""
    return fared.bulge > max(MUCH, linear + MORE) and fared.bulging > SOME


def _unmeasured(measured: Sequence[Fared | Standing], *, clamped: bool) -> str:
    """The options of collapse and bake whose effect is not known yet, in words; "" where all were measured."""
    known = {"lbs", *(each.method for each in measured)}
    options = [f"--method {name}" for name in SKINNING_METHODS if name not in known]
    return " or ".join(options if clamped else ["--bulge-clamp", *options])


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
