"""Depth of tails in colliders: literal cases, and what a simulation leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.model import Clip
from anim.simulation.spring_bones import penetration
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import Collider, ColliderShape
from anim.simulation.spring_bones.penetration import deepest_penetration
from anim.simulation.spring_bones.simulate import SpringOptions, simulate_springs
from tests.anim.simulation.spring_bones.swaying import BONES, CHAIN, swaying
from tests.clips import skeleton, track

SPHERE, CAPSULE, PLANE = ColliderShape
RIG = skeleton([-1, 0, 1], translation=[[0, 0, 0], [0, 1, 0], [0, 1, 0]])  # the tail is 2 m above the root


@pytest.mark.parametrize(
    ("collider", "depth"),
    [
        (Collider(0, SPHERE, (0, 2.5, 0), radius=0.6), 0.1 + 0.05),
        (Collider(0, SPHERE, (0, 3, 0), radius=0.5), 0.0),
        (Collider(0, SPHERE, (0, 0, 0), radius=1.5, inside=True), 0.5 + 0.05),
        (Collider(0, CAPSULE, (-1, 2.25, 0), (1, 2.25, 0), radius=0.5), 0.25 + 0.05),
        (Collider(0, CAPSULE, (0, 0, 0), (0, 1, 0), radius=0.5, inside=True), 0.5 + 0.05),
        (Collider(0, PLANE, (0, 3, 0), normal=(0, 2, 0)), 1 + 0.05),
        (Collider(None, PLANE, (0, 0, 0), normal=(0, 1, 0)), 0.0),
    ],
)
def test_the_depth_is_that_of_the_tail_and_its_radius(collider: Collider, depth: float) -> None:
    chain = SpringChain("", (SpringJoint(1, 2, SpringParameters(hit_radius=0.05)),), (0,))
    bones = SpringBones((chain,), (collider,))
    assert deepest_penetration(RIG, Clip("", ()), bones, np.zeros(1)) == pytest.approx(depth)


def test_the_deepest_time_counts() -> None:
    rise = Clip("", (track("translation", [0, 1], np.outer([0, 0.3], [0, 1, 0])),))
    chain = SpringChain("", (SpringJoint(1, 2, SpringParameters()),), (0,))
    bones = SpringBones((chain,), (Collider(None, SPHERE, (0, 2.6, 0), radius=0.5),))
    assert deepest_penetration(RIG, rise, bones, np.array([0, 0.5, 1.0])) == pytest.approx(0.2)


def test_a_simulation_keeps_tails_out_of_a_ball() -> None:
    ball = Collider(0, SPHERE, (0.1, 0.65, 0), radius=0.12)
    free = SpringBones(BONES.chains, (ball,))
    met = SpringBones((replace(BONES.chains[0], colliders=(0,)),), (ball,))
    times = np.arange(61) / 60
    depths = []
    for bones in (free, met):
        clip = simulate_springs(CHAIN, swaying(), bones, SpringOptions(warm_up=1)).clip
        depths.append(deepest_penetration(CHAIN, clip, met, times))
    assert depths[1] < 0.3 * depths[0]


def test_tails_are_measured_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = Collider(0, SPHERE, (0.1, 0.65, 0), radius=0.12)
    bones = SpringBones((replace(BONES.chains[0], colliders=(0,)),), (ball,))
    times = np.arange(61) / 60
    whole = deepest_penetration(CHAIN, swaying(), bones, times)
    monkeypatch.setattr(penetration, "BLOCK_POINTS", 1)
    assert deepest_penetration(CHAIN, swaying(), bones, times) == whole > 0
