"""What to do about skin that collapses, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from anim.skinning.collapse import LOW, MeshCollapse
from anim.skinning.fared import Fared

GOOD = 0.95  # of a ring's radius: what twist joints should leave
MUCH = 1.25  # times the distance from the links of its joints at rest: a bulge that is seen
MORE = 0.1  # than linear blending: else it is the motion that does it
SOME = 0.01  # share of vertices that has to bulge to be worth a word


@dataclass(frozen=True, slots=True)
class Found:
    """A mesh in a clip, by the clip's name."""

    clip: str
    mesh: MeshCollapse


def advice(found: Sequence[Found]) -> Iterator[str]:
    """Yield what to do, a line each, the worst of all first; one line that all is well where it is."""
    pinched = sorted((each for each in found if each.mesh.worst.index < LOW), key=lambda each: each.mesh.worst.index)
    if pinched:
        yield from _against_pinching(pinched)
    elif found:
        worst = min(found, key=lambda each: each.mesh.worst.index)
        yield f"linear blending is good enough: no vertex falls below {LOW} (least {worst.mesh.worst.index:.3f})"
    yield from _against_bulging(found)


def twist_joints(angle: float) -> int:
    """Return how many joints must share a twist by `angle` rad so that each leaves 95 % of the radius: cos(θ / 2n).

    twist_joints(π / 2) → 3
    """
    return max(1, math.ceil(angle / (2 * math.acos(GOOD)) - 1e-9))


def _against_pinching(pinched: list[Found]) -> Iterator[str]:
    first = pinched[0].mesh
    worst = first.worst
    clips = len({each.clip for each in pinched})
    places = f"'{worst.joint}' against '{worst.other}', {math.degrees(worst.angle):.0f}° at {worst.time:.2f} s"
    told = "1 clip pinches" if clips == 1 else f"{clips} clips pinch"
    yield f"{told}; worst {worst.index:.2f} in '{pinched[0].clip}': {places}"
    volumes = {each.method: float(each.volume.min()) for each in first.methods if each.volume is not None}
    keeps = [f"{name} keeps {100 * least:.0f} %" for name, least in volumes.items()]
    kept = f" ({', '.join(keeps)} of the volume)" if keeps else ""
    yield f"bake it with --method dqs{kept}"
    if worst.twist and (count := twist_joints(worst.angle)) > 1:
        radius = 100 * math.cos(worst.angle / (2 * count))
        yield (
            f"or share the twist among {count} joints between '{worst.joint}' and '{worst.other}' "
            f"({radius:.0f} % of the radius stay), which every player shows"
        )


def _against_bulging(found: Sequence[Found]) -> Iterator[str]:
    swollen: list[tuple[Fared, Found]] = []
    for each in found:
        linear = max((fared.bulge for fared in each.mesh.methods if fared.method == "lbs"), default=1.0)
        swollen += [(fared, each) for fared in each.mesh.methods if fared.method == "dqs" and _swells(fared, linear)]
    if swollen:
        fared, each = max(swollen, key=lambda pair: pair[0].bulge)
        yield (
            f"dqs bulges up to {fared.bulge:.2f}× at '{fared.joint}' ({each.clip}, {fared.time:.2f} s): "
            "look at it, and try --bulge-clamp or --method cor"
        )


def _swells(fared: Fared, linear: float) -> bool:
    """Whether a method bulges so that it is seen, and more than linear blending does."""
    return fared.bulge > max(MUCH, linear + MORE) and fared.bulging > SOME
