"""Ranking of skinning methods over meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from anim.skinning.analysis.collapse import MeshCollapse

SAME_VOLUME_FRACTION = 0.02  # of the volume, 1 % of a ring's radius: a smaller difference is invisible
BULGE_DIGITS = 2  # decimals of a bulge in comparisons


@dataclass(frozen=True, slots=True)
class RankedMethod:
    """Worst scores of one method over meshes.

    volume: smallest, relative to bind pose; None without a closed part. bulge: largest, relative to bind pose.
    unusable: whether any deviation from linear blending exceeds the model's size.
    """

    method: str
    volume: float | None
    bulge: float
    unusable: bool = False


def rank_methods(meshes: Sequence[MeshCollapse]) -> tuple[RankedMethod, ...]:
    """Return the worst scores of each method over all meshes (at least one), in the order of measurement."""
    found = []
    for fared in zip(*(each.methods for each in meshes), strict=True):
        volumes = [float(each.volume.min()) for each in fared if each.volume is not None]
        unusable = any(each.unusable for each in fared)
        found.append(
            RankedMethod(fared[0].method, min(volumes, default=None), max(each.bulge for each in fared), unusable)
        )
    return tuple(found)


def best_method(found: Sequence[RankedMethod]) -> RankedMethod | None:
    """Return the best method other than lbs; None without a usable one.

    The one that keeps most of the volume (more than in bind pose is no gain); of those within 2 % of it the one with
    the smallest bulge; of equal ones the first. Without a closed part, bulge alone decides.
    """
    others = [each for each in found if each.method != "lbs" and not each.unusable]
    most = max((_kept_volume(each) for each in others), default=0.0)
    near = [each for each in others if _kept_volume(each) >= most - SAME_VOLUME_FRACTION]
    return min(near, key=lambda each: round(each.bulge, BULGE_DIGITS), default=None)


def _kept_volume(standing: RankedMethod) -> float:
    return 1.0 if standing.volume is None else min(standing.volume, 1.0)
