"""What `bake` says about a scene besides its result."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.model import Instance, Scene
from anim.skinning.bake import baked
from anim.skinning.between import Missed
from anim.skinning.weights import bad_sums
from cli import report
from cli.report import Voice

SHOWN = 1e-3  # of the diagonal; less is not seen


def weights(instances: Sequence[Instance], method: str, voice: Voice) -> None:
    """Say which meshes have skin weights that don't add up to 1, and what the method makes of them."""
    once = {id(each.mesh): each for each in reversed(instances)}
    for each in reversed(once.values()):
        several = each.skin is not None and len(each.skin.joints) > 1  # one joint alone is blended linearly
        what = "taken as shares of their sum" if several and method != "lbs" else "used as they are"
        for bad in bad_sums([each]):
            count = "1 vertex" if bad.count == 1 else f"{bad.count} vertices"
            words = f"note: mesh '{bad.mesh}': skin weights of {count} don't add up to 1"
            voice.say(f"{words} ({bad.least:.3g} … {bad.most:.3g}), {what}")


def left_out(scene: Scene, nodes: Sequence[int] | None, voice: Voice) -> None:
    """Say how many vertices are not baked as only nodes move them."""
    kept = {id(each) for each in baked(scene, nodes=nodes)}
    lost = [each for each in baked(scene, rigid=True, nodes=nodes) if id(each) not in kept]
    if lost:
        count = sum(len(each.mesh.positions) for each in lost)
        voice.say(f"note: {count} vertices that only nodes move are left out; --rigid takes them in")


def gaps(found: Sequence[tuple[str, Missed]], rest: Floats, voice: Voice) -> None:
    """Say how far vertices are off the straight way between frames, of the clip where that can be seen best.

    found: what clips of these names miss. rest: (V, 3) m, for their size.
    """
    diagonal = float(np.linalg.norm(np.ptp(rest, axis=0))) if len(rest) else 0.0
    seen = [(missed, name) for name, missed in found if missed.distance > SHOWN * diagonal]
    if seen:
        missed, name = max(seen)
        others = f" ({len(seen)} clips have such places)" if len(seen) > 1 else ""
        voice.say(
            f"note: between frames a vertex is up to {report.length(missed.distance)} off the straight way, at "
            f"{missed.time:.3g} s of {name}{others}; --fps puts more frames there"
        )
