"""What is asked of an optimization, in one value."""

from __future__ import annotations

from dataclasses import dataclass, field

from anim.optimize.limits import Bounds, Objective, Packing, Policy
from anim.optimize.verify import PLAYERS


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked for. effort: a name in EFFORTS. players: names in PLAYERS, who must show the motion rightly."""

    bounds: Bounds
    policy: Policy = field(default_factory=Policy)
    packing: Packing = Packing.CORE
    objective: Objective = Objective.FILE
    effort: str = "balanced"
    players: tuple[str, ...] = PLAYERS
