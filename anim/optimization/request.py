"""The request of an optimization: all its options in one value."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from anim.optimization.options import Bounds, Objective, Packing, Policy
from anim.optimization.verification import PLAYERS


@dataclass(frozen=True, slots=True)
class Request:
    """Bounds, policy, storage and effort of an optimization.

    effort: a name in EFFORTS. players: names in PLAYERS; the bounds hold for each. given: the bounds as given, if
    relative to the diagonal: another rest pose has another diagonal, but the request is the same.
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
        """Text that is equal for equal requests."""
        return repr(replace(self, bounds=Bounds(0.0, 0.0)) if self.given else self)
