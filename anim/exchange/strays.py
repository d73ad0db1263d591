"""Joints that hang elsewhere in the target than in the source, as feet of IK rigs do: kept where they belong."""

from __future__ import annotations

from anim.arrays import Floats
from anim.exchange.transfer import Transfer
from anim.exchange.turns import world_rotations
from anim.maths import matrix, quaternion
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.sampling import pose as posed
from anim.sampling import world_matrices


def with_strays(clip: Clip, follow: Transfer, times: Floats) -> Clip:
    """Return the clip with a translation track for each matched joint that does not hang below the topmost one.

    Such a joint is held at the joint that it hangs on in the source, as both stand at rest: the upper leg at the hips,
    the foot at the lower leg. clip: what moves the others. times: (F,) s, of its keys.
    """
    for node, anchor in strays(follow):
        motion = posed(follow.target, clip, times)
        world, rotation = world_matrices(follow.target, motion), world_rotations(follow.target, motion.rotation)[anchor]
        back = quaternion.conjugate(follow.at_rest.rotations[anchor])
        turned = quaternion.multiply(quaternion.normalize(rotation), back)
        offset = follow.at_rest.positions[node] - follow.at_rest.positions[anchor]
        place = world[:, anchor, :, 3] + quaternion.rotate(turned, offset)
        parent = int(follow.target.parents[node])
        local = place if parent < 0 else matrix.apply(matrix.inverse(world[:, parent]), place[:, None])[:, 0]
        clip = Clip(clip.name, (*clip.tracks, Track(node, "translation", Interpolation.LINEAR, times, local)))
    return clip


def strays(follow: Transfer) -> list[tuple[int, int]]:
    """Return those joints and what each is held at, in the source's order: what is held at must be placed first."""
    found = []
    for a, b in follow.pairs.items():
        if b != follow.top and follow.top not in _above(follow.target, b):
            anchor = next((follow.pairs[up] for up in _above(follow.source, a) if up in follow.pairs), follow.top)
            if anchor != b:
                found.append((b, anchor))
    held = {b for b, _ in found}
    # What hangs on another stray goes with it where the source has it so too.
    return [(b, anchor) for b, anchor in found if not (anchor in held and anchor in _above(follow.target, b))]


def _above(skeleton: Skeleton, node: int) -> list[int]:
    """Ancestors, the nearest first."""
    found = []
    while (node := int(skeleton.parents[node])) >= 0:
        found.append(node)
    return found
