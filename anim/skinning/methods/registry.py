"""The skinning methods, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from anim.skinning.binding import SkinBinding
from anim.skinning.methods.centers_of_rotation import CentersOfRotation
from anim.skinning.methods.dual_quaternion import DualQuaternion
from anim.skinning.methods.linear_blend import LinearBlend
from anim.skinning.methods.skinner import Skinner


@dataclass(frozen=True, slots=True)
class Method:
    """One method. about: for --help. skinner: called with a rig, and whether its points are constant.

    The second argument also requires that no normals or tangents are requested.
    """

    about: str
    skinner: Callable[[SkinBinding, bool], Skinner]


SKINNING_METHODS: dict[str, Method] = {
    "lbs": Method("linear blend, as in every player; twisted skin collapses", LinearBlend),
    "dqs": Method(
        "dual quaternions: twists keep their volume, bends bulge a little", lambda rig, _: DualQuaternion(rig)
    ),
    "cor": Method(
        "optimized centers of rotation: neither collapses nor bulges; slow to start",
        lambda rig, _: CentersOfRotation(rig),
    ),
}
