"""Friction and restitution of pairs of materials by glTF's rules, and by those of Rapier."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import combinations

from anim.simulation.rigid_bodies.description import Material, combine

RAPIER_MODES = ("maximum", "multiply", "minimum", "average")  # the first that either material has counts
Pair = tuple[Material, Material]


class MaterialPairs:
    """Numbers of Rapier's colliders, and the pairs of materials for which they give other values than glTF's rules.

    Rapier has one friction: that of a material here, static or dynamic. Where all frictions are alike and the static
    one differs, the mode is chosen so that one collider with dynamic friction is enough for a pair to slide.
    """

    def __init__(self, materials: Sequence[Material]) -> None:
        """materials: of all colliders."""
        counts = Counter(materials)
        frictions = {(each.static_friction, each.dynamic_friction, each.friction_combine) for each in counts}
        self.has_static = any(static != dynamic for static, dynamic, _ in frictions)
        self.are_alike = len(frictions) == 1
        self._coefficients: dict[tuple[Pair, bool], tuple[float, float]] = {}
        # of both materials the rarer, so that few colliders have hooks
        self.differing = {
            min(pair, key=lambda each: counts[each])
            for pair in combinations(counts, 2)
            if any(
                self.rapier_coefficients(pair, (slides, slides)) != self.coefficients(pair, slides)
                for slides in (False, True)
            )
        }

    @property
    def need_hooks(self) -> bool:
        """True if Rapier's own rules give wrong values for any pair."""
        return self.has_static or bool(self.differing)

    def friction(self, material: Material, slides: bool) -> float:
        """Return the number of a collider."""
        value = material.dynamic_friction if slides else material.static_friction
        mode = material.friction_combine
        return combine((mode, mode), value, value) if self._has_own_mode else value

    def friction_mode(self, material: Material) -> str:
        """Return the mode of a collider."""
        if not self._has_own_mode:
            return material.friction_combine
        return "minimum" if material.static_friction >= material.dynamic_friction else "maximum"

    def coefficients(self, pair: Pair, slides: bool) -> tuple[float, float]:
        """Return friction and restitution by glTF's rules."""
        key = pair, slides
        if key not in self._coefficients:
            a, b = pair
            first, second = (each.dynamic_friction if slides else each.static_friction for each in pair)
            friction = combine((a.friction_combine, b.friction_combine), first, second)
            modes = (a.restitution_combine, b.restitution_combine)
            self._coefficients[key] = friction, combine(modes, a.restitution, b.restitution)
        return self._coefficients[key]

    def rapier_coefficients(self, pair: Pair, slide: tuple[bool, bool]) -> tuple[float, float]:
        """Return friction and restitution by Rapier's rules. slide: whose collider has its dynamic friction."""
        a, b = pair
        first, second = self.friction(a, slide[0]), self.friction(b, slide[1])
        friction = combine((self.friction_mode(a), self.friction_mode(b)), first, second, RAPIER_MODES)
        modes = (a.restitution_combine, b.restitution_combine)
        return friction, combine(modes, a.restitution, b.restitution, RAPIER_MODES)

    @property
    def _has_own_mode(self) -> bool:
        return self.has_static and self.are_alike
