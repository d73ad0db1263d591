"""How methods stand against each other on meshes, and which of them did best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from anim.skinning.analysis.collapse import MeshCollapse

SAME_VOLUME_FRACTION = 0.02  # of the volume, 1 % of a ring's radius: less between two methods is not seen
FINE = 2  # digits of a bulge that count


@dataclass(frozen=True, slots=True)
class RankedMethod:
    """What one method did to meshes at worst.

    volume: least against bind pose, None where no part is closed. bulge: greatest, against bind pose.
    unusable: whether any is farther from linear blending than the model is large.
    """

    method: str
    volume: float | None
    bulge: float
    unusable: bool = False


def rank_methods(meshes: Sequence[MeshCollapse]) -> tuple[RankedMethod, ...]:
    """Return how each method stands over all of the meshes (at least one), in the order in which it was measured."""
    found = []
    for fared in zip(*(each.methods for each in meshes), strict=True):
        volumes = [float(each.volume.min()) for each in fared if each.volume is not None]
        unusable = any(each.unusable for each in fared)
        found.append(
            RankedMethod(fared[0].method, min(volumes, default=None), max(each.bulge for each in fared), unusable)
        )
    return tuple(found)


def best_method(found: Sequence[RankedMethod]) -> RankedMethod | None:
    """Return the method other than lbs that did best; None where there is none that can be used.

    The one that keeps most of the volume (what is above bind pose is no gain); of those within 2 % of it the one that
    bulges least; of equal ones the first. Where nothing is closed, bulge alone decides.
    """
    others = [each for each in found if each.method != "lbs" and not each.unusable]
    most = max((_is_kept(each) for each in others), default=0.0)
    near = [each for each in others if _is_kept(each) >= most - SAME_VOLUME_FRACTION]
    return min(near, key=lambda each: round(each.bulge, FINE), default=None)


def _is_kept(standing: RankedMethod) -> float:
    return 1.0 if standing.volume is None else min(standing.volume, 1.0)
