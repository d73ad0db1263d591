"""Friction and restitution of contacts by glTF's rules, on Rapier.

Rapier combines the numbers of two colliders by itself. Where that gives another value, it asks a hook in Python about
each pair of a collider with hooks, in every step, which costs more than the step. So contacts are looked at 60 times a
second; in between colliders have the numbers that are right for most contacts, and hooks only where they aren't.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from anim.simulation.rigid_bodies.description import Material
from anim.simulation.rigid_bodies.rapier.materials import MaterialPairs
from anim.simulation.rigid_bodies.rapier.package import load_package

MAX_STICKING_SPEED_M_S = 0.02  # of contacts, below which static friction counts; those at rest creep less
SAMPLE_S = 1 / 60  # between two decisions whether a contact slides
RULES = {"average": "AVERAGE", "minimum": "MIN", "maximum": "MAX", "multiply": "MULTIPLY"}


@dataclass(slots=True, eq=False)
class _Collider:
    """Collider of Rapier, with its body's index, its material, and what is set."""

    body: int
    material: Material
    built: Any
    slides: bool = False
    has_hooks: bool = True


class FrictionHooks:
    """Friction and restitution of all contacts: hooks of Rapier's world.

    A collider has its static friction while its body is slow or any of its contacts sticks, else the dynamic one.
    """

    def __init__(self, materials: Sequence[Material], step: float) -> None:
        """materials: of all colliders. step: s."""
        self._pairs = MaterialPairs(materials)
        self.are_needed = self._pairs.need_hooks
        hooks = load_package().ActiveHooks
        self._hooks = (hooks.empty(), hooks.MODIFY_SOLVER_CONTACTS)
        self._colliders: dict[int, _Collider] = {}
        self._slides: dict[tuple[int, int], bool] = {}
        self._interval, self._step = max(1, round(SAMPLE_S / step)), 0
        self._slow: Sequence[bool] = ()

    def add(self, index: int, body: int, material: Material, built: Any) -> None:
        """Add a collider and set its numbers. index: Rapier's. body: index of its body. built: Rapier's collider."""
        rules = load_package().CoefficientCombineRule
        built.friction = self._pairs.friction(material, False)
        built.friction_combine_rule = getattr(rules, RULES[self._pairs.friction_mode(material)])
        built.restitution = material.restitution
        built.restitution_combine_rule = getattr(rules, RULES[material.restitution_combine])
        built.active_hooks = self._hooks[self.are_needed]
        self._colliders[index] = _Collider(body, material, built)

    def begin_step(self, find_slow: Callable[[float], Sequence[bool]]) -> None:
        """Choose numbers and hooks of colliders for the next step.

        find_slow: returns for each body whether no point of it is faster than a speed in m/s.
        """
        if not self.are_needed:
            return
        phase = self._step % self._interval
        self._step += 1
        if phase == 0:
            self._begin_sample(find_slow(MAX_STICKING_SPEED_M_S / 2))
        if phase == 1:
            self._end_sample()

    def _begin_sample(self, slow: Sequence[bool]) -> None:
        """Put hooks on all that may slide; contacts of two slow bodies stick."""
        self._slow, self._slides = slow, {}
        for each in self._colliders.values():
            moves = self._pairs.has_static and not slow[each.body]
            self._set(each, each.slides and moves, moves or each.material in self._pairs.differing)

    def _end_sample(self) -> None:
        """Leave hooks where the numbers of both colliders are wrong; new contacts of unlike materials need them too."""
        if not self._pairs.has_static:
            return
        sticks = {index for pair, slides in self._slides.items() if not slides for index in pair}
        slide = {k: not self._slow[each.body] and k not in sticks for k, each in self._colliders.items()}
        counts = Counter(index for pair in self._slides for index in pair)
        hooked = set()
        for (a, b), slides in self._slides.items():
            materials = (self._colliders[a].material, self._colliders[b].material)
            if self._pairs.rapier_coefficients(materials, (slide[a], slide[b])) != self._pairs.coefficients(
                materials, slides
            ):
                hooked.add(a if counts[a] <= counts[b] else b)
        for k, each in self._colliders.items():
            unlike = not self._pairs.are_alike and not self._slow[each.body]
            self._set(each, slide[k], k in hooked or unlike or each.material in self._pairs.differing)

    def _set(self, collider: _Collider, slides: bool, has_hooks: bool) -> None:
        if collider.slides != slides:
            collider.slides, collider.built.friction = slides, self._pairs.friction(collider.material, slides)
        if collider.has_hooks != has_hooks:
            collider.has_hooks, collider.built.active_hooks = has_hooks, self._hooks[has_hooks]

    def modify_solver_contacts(self, context: Any) -> None:
        """Set friction and restitution of one pair, before each step; called by Rapier."""
        if not context.num_solver_contacts():  # four of five pairs are only near each other
            return
        pair = context.collider1.index, context.collider2.index
        slides = self._slides.get(pair)
        if slides is None:
            slides = self._slides[pair] = self._pairs.has_static and _slides(context)
        materials = self._colliders[pair[0]].material, self._colliders[pair[1]].material
        context.friction, context.restitution = self._pairs.coefficients(materials, slides)


def _slides(context: Any) -> bool:
    """True if a contact point of a pair moves along the surface; plain numbers, for speed."""
    handles = [each for each in (context.rigid_body1, context.rigid_body2) if each is not None]
    bodies = [body for body in (context.bodies[each] for each in handles) if not body.is_fixed]
    nx, ny, nz = context.normal.to_tuple()
    for contact in context.solver_contacts:
        x = y = z = 0.0
        point = contact.point
        for body, sign in zip(bodies, (1.0, -1.0), strict=False):
            vx, vy, vz = body.velocity_at_point(point).to_tuple()
            x, y, z = x + sign * vx, y + sign * vy, z + sign * vz
        along = x * nx + y * ny + z * nz
        if x * x + y * y + z * z - along * along > MAX_STICKING_SPEED_M_S**2:
            return True
    return False
