"""Friction and restitution of contacts by glTF's rules, on Rapier.

Rapier combines the numbers of two colliders by itself. Where that gives another value, it asks a hook in Python about
each pair of a collider with hooks, touching or not, in every step, which costs more than the step. So 60 times a second
contacts are read from Rapier, and colliders get the numbers that are right for most of them; hooks only where they
aren't.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from anim.arrays import Bools
from anim.simulation.rigid_bodies.description import Material
from anim.simulation.rigid_bodies.rapier.materials import MaterialPairs
from anim.simulation.rigid_bodies.rapier.package import load_package
from anim.simulation.rigid_bodies.rapier.slip import ColliderPair, SlipReader, Velocity

MAX_STICKING_SPEED_M_S = 0.02  # of contacts, below which static friction counts; those at rest creep less
SAMPLE_S = 1 / 60  # between two decisions whether a contact slides
MAX_HOOKED = 4  # colliders with hooks for wrong friction: each costs as much as twenty bodies without
RULES = {"average": "AVERAGE", "minimum": "MIN", "maximum": "MAX", "multiply": "MULTIPLY"}


@dataclass(slots=True, eq=False)
class _Collider:
    """Collider of Rapier, with its body's index, its material, and what is set."""

    body: int
    material: Material
    built: Any
    slides: bool = False
    has_hooks: bool = False


class FrictionHooks:
    """Friction and restitution of all contacts: hooks of Rapier's world.

    A collider has its static friction while its body is slow or any of its contacts sticks, else the dynamic one. That
    is wrong for a contact that slides between two colliders that stick elsewhere, which hooks correct. In piles, with
    more than MAX_HOOKED such colliders at once, the others have a friction between both for this sample.
    """

    def __init__(self, materials: Sequence[Material], step: float, units: float = 1.0) -> None:
        """materials: of all colliders. step: s. units: length units of the world per metre."""
        self._max_sticking_speed = units * MAX_STICKING_SPEED_M_S
        self._pairs = MaterialPairs(materials)
        self.are_needed = self._pairs.need_hooks
        package = load_package()
        self._hooks = (package.ActiveHooks.empty(), package.ActiveHooks.MODIFY_SOLVER_CONTACTS)
        self._modes = {name: getattr(package.CoefficientCombineRule, rule) for name, rule in RULES.items()}
        self._colliders: dict[int, _Collider] = {}
        self._slides: dict[ColliderPair, bool] = {}
        self._slips: Mapping[ColliderPair, Velocity] = {}
        self._are_right: dict[tuple[Material | bool, ...], bool] = {}
        self._interval, self._step = max(1, round(SAMPLE_S / step)), 0

    def add(self, index: int, body: int, material: Material, built: Any) -> None:
        """Add a collider and set its numbers. index: Rapier's. body: index of its body. built: Rapier's collider."""
        built.friction = self._pairs.friction(material, False)
        built.friction_combine_rule = self._modes[self._pairs.friction_mode(material)]
        built.restitution = material.restitution
        built.restitution_combine_rule = self._modes[material.restitution_combine]
        self._colliders[index] = _Collider(body, material, built)
        self._set_hooks(self._colliders[index], material in self._pairs.differing)

    def begin_step(self, reader: SlipReader) -> None:
        """Choose numbers and hooks of colliders for the next step, by the speeds of the last one."""
        if not self._pairs.has_static:
            return
        if self._step == 0 or self._step % self._interval == 1 % self._interval:  # the first step has no contacts yet
            slow = reader.find_slow(self._max_sticking_speed / 2)
            self._choose(slow, reader.find_slips(slow))
        self._step += 1

    def _choose(self, slow: Bools, slips: Mapping[ColliderPair, Velocity]) -> None:
        """Set friction and hooks of all colliders.

        slow: bodies whose contacts with each other stick. slips: velocities of all other contacts.
        """
        most = self._max_sticking_speed
        self._slides = {pair: _slides_on(self._slips.get(pair), slip, most) for pair, slip in slips.items()}
        self._slips = slips
        sticking = {index for pair, slides in self._slides.items() if not slides for index in pair}
        are_slow = slow.tolist()
        for index, each in self._colliders.items():
            self._set_friction(each, not are_slow[each.body] and index not in sticking)
        hooked = sorted(self._find_wrong())[:MAX_HOOKED]
        for index, each in self._colliders.items():
            self._set_hooks(each, index in hooked or each.material in self._pairs.differing)

    def _find_wrong(self) -> set[int]:
        """Colliders that need hooks for a contact; of both the one with fewer contacts."""
        counts = Counter(index for pair in self._slides for index in pair)
        return {
            min(pair, key=lambda index: counts[index])
            for pair, slides in self._slides.items()
            if not self._is_right(pair, slides)
        }

    def _is_right(self, pair: ColliderPair, slides: bool) -> bool:
        """Return True if Rapier gives a contact its friction by the numbers of both colliders."""
        a, b = (self._colliders[index] for index in pair)
        key = a.material, b.material, slides, a.slides, b.slides
        if key not in self._are_right:
            found = self._pairs.rapier_coefficients((a.material, b.material), (a.slides, b.slides))
            self._are_right[key] = found == self._pairs.coefficients((a.material, b.material), slides)
        return self._are_right[key]

    def _set_friction(self, collider: _Collider, slides: bool) -> None:
        if collider.slides != slides:
            collider.slides, collider.built.friction = slides, self._pairs.friction(collider.material, slides)

    def _set_hooks(self, collider: _Collider, has_hooks: bool) -> None:
        if collider.has_hooks != has_hooks:
            collider.has_hooks, collider.built.active_hooks = has_hooks, self._hooks[has_hooks]

    def modify_solver_contacts(self, context: Any) -> None:
        """Set friction and restitution of one pair, before each step; called by Rapier."""
        if not context.num_solver_contacts():  # four of five pairs are only near each other
            return
        pair = context.collider1.index, context.collider2.index
        slides = self._slides.get(pair)
        if slides is None:
            slides = self._slides[pair] = self._pairs.has_static and _slides(context, self._max_sticking_speed)
        materials = self._colliders[pair[0]].material, self._colliders[pair[1]].material
        context.friction, context.restitution = self._pairs.coefficients(materials, slides)


def _slides_on(before: Velocity | None, now: Velocity, most: float) -> bool:
    """Return True for a contact that slides at two samples; with opposed velocities it has stopped in between."""
    has_turned = before is not None and sum(a * b for a, b in zip(before, now, strict=True)) < 0
    return not has_turned and math.hypot(*now) > most


def _slides(context: Any, most: float) -> bool:
    """True if a contact point of a pair is faster than `most` along the surface; plain numbers, for speed."""
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
        if x * x + y * y + z * z - along * along > most * most:
            return True
    return False
