"""What is asked of an optimization, in one value."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from anim.optimization.options import Bounds, Objective, Packing, Policy
from anim.optimization.verification import PLAYERS


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked for.

    effort: a name in EFFORTS. players: names in PLAYERS, who must show the motion rightly. given: the bounds as they
    were given, where they are shares of the diagonal: another rest pose has another, and yet it is the same request.
    """

    bounds: Bounds
    policy: Policy = field(default_factory=Policy)
    packing: Packing = Packing.CORE
    objective: Objective = Objective.FILE
    effort: str = "balanced"
    players: tuple[str, ...] = PLAYERS
    given: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What is the same of two requests that ask for the same."""
        return repr(replace(self, bounds=Bounds(0.0, 0.0)) if self.given else self)
