"""Detection of collapse in a clip, by the smallest collapse index or by linear blending's volume loss."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.skinning.analysis.collapse import LOW_INDEX, MeshCollapse
from anim.skinning.analysis.method_scores import MethodScore
from anim.skinning.analysis.ranking import SAME_VOLUME_FRACTION

MIN_VOLUME_FRACTION = 0.9  # of the volume: 1 − ⅔ f sin²(θ/2) for 90° blended over f = 30 % of a tube


def is_collapsed(mesh: MeshCollapse) -> bool:
    """Return whether skin looks pinched, by the collapse index or by volume.

    True if a vertex's collapse index is ever below 0.7, or linear blending ever keeps less than 90 % of the volume in
    bind pose. A tube twisted by θ, blended over a fraction f of its length, keeps 1 − ⅔ f sin²(θ/2): at 90° all rings
    together lose a tenth or more from f = 30 % on, though the narrowest has an index of 0.71. The volume counts if
    parts of the mesh are closed and lbs is among its methods. If others are too, one of them has to keep more at that
    time: a loss in every method (a joint that shrinks, a fold) is not caused by blending. Source: halves of two
    rotations that differ by θ leave cos(θ/2) of a radius perpendicular to the axis.
    """
    if mesh.worst.index < LOW_INDEX:
        return True
    linear = linear_volume(mesh)
    return linear is not None and bool(((linear < MIN_VOLUME_FRACTION) & _avoidable(mesh, linear)).any())


def linear_volume(mesh: MeshCollapse) -> Floats | None:
    """Return the volume (F,) by linear blending relative to bind pose; None unless measured."""
    return next((each.volume for each in mesh.methods if each.method == "lbs"), None)


def _avoidable(mesh: MeshCollapse, linear: Floats) -> Bools:
    """Mask (F,) of times at which another method keeps more volume; all without another method."""
    others = [each.volume for each in mesh.methods if _helps(each) and each.volume is not None]
    return (
        np.asarray(np.max(others, axis=0) > linear + SAME_VOLUME_FRACTION) if others else np.ones(len(linear), np.bool_)
    )


def _helps(fared: MethodScore) -> bool:
    return fared.method != "lbs" and not fared.unusable
