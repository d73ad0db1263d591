"""Euler order of each node: one for all, by name pattern, or the one farthest from gimbal lock."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from anim.arrays import Floats
from anim.errors import NotFoundError, RangeError
from anim.maths import euler
from anim.maths.euler import ORDERS, AxesConvention

AUTO = "auto"
DEFAULT_ORDER = "ZXY"  # the order of most recorders
CANDIDATES = (DEFAULT_ORDER, *(order for order in ORDERS if not euler.is_proper(order) and order != DEFAULT_ORDER))


@dataclass(frozen=True, slots=True)
class OrderRules:
    """Orders by node name. rules: (glob, order), the first match counts; `otherwise` without a match.

    An order is one of the twelve or "auto": of the six without a repeated axis, supported by BVH, Maya and FBX, the one
    farthest from gimbal lock.
    """

    otherwise: str = DEFAULT_ORDER
    rules: tuple[tuple[str, str], ...] = ()

    @property
    def is_one(self) -> bool:
        """True if all nodes have the same order."""
        return not self.rules and self.otherwise != AUTO

    def of(self, name: str, q: Floats, frame: AxesConvention = AxesConvention.INTRINSIC) -> str:
        """Return the order for a node and its rotations (..., 4)."""
        order = next((order for glob, order in self.rules if fnmatchcase(name, glob)), self.otherwise)
        if order != AUTO:
            return order
        found = _choose_order(q.reshape(-1, 4))
        return found if frame == AxesConvention.INTRINSIC else found[::-1]

    def check(self, names: Sequence[str]) -> None:
        """Raise NotFoundError for a rule without a matching name."""
        for glob, order in self.rules:
            if not any(fnmatchcase(name, glob) for name in names):
                near = difflib.get_close_matches(glob, names, n=1)
                help = f"did you mean '{near[0]}'?" if near else ""
                raise NotFoundError(f"order '{glob}={order}', but no node is called that", help=help)


def parse(text: str) -> OrderRules:
    """Parse rules such as "ZXY", "auto" or "hips=ZXY,*arm=YZX,auto", in any case.

    Raises RangeError for an unknown order, or more than one without a name.
    """
    rules, otherwise = [], list[str]()
    for item in text.split(","):
        glob, named, order = item.strip().rpartition("=")
        checked = AUTO if order.strip().casefold() == AUTO else euler.check_order(order.strip())
        if named:
            rules.append((glob.strip(), checked))
        else:
            otherwise.append(checked)
    if len(otherwise) > 1:
        raise RangeError(f"`order` is '{text}' (expected one for all nodes, and NAME=ORDER for others)")
    return OrderRules(otherwise[0] if otherwise else DEFAULT_ORDER, tuple(rules))


def _choose_order(q: Floats) -> str:
    """The intrinsic order farthest from lock; the usual one if no other is better."""
    nearest = {order: float(euler.gimbal_distance(q, order=order).min()) for order in CANDIDATES}
    best = max(CANDIDATES, key=lambda order: nearest[order])
    return DEFAULT_ORDER if nearest[best] <= nearest[DEFAULT_ORDER] + np.radians(1.0) else best
