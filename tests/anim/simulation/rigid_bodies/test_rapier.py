"""Rapier: the same numbers for any number of threads and processes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from anim.arrays import Bools
from anim.simulation.rigid_bodies.description import Material, Shape
from anim.simulation.rigid_bodies.rapier.friction import MAX_HOOKED, FrictionHooks
from anim.simulation.rigid_bodies.rapier.materials import MaterialPairs
from anim.simulation.rigid_bodies.rapier.slip import ColliderPair, SlipReader, Velocity
from tests.anim.simulation.rigid_bodies.cases import body, box_pile, ground, needs_rapier, run
from tests.cli.running import ROOT

PILE = """
import hashlib
from tests.anim.simulation.rigid_bodies.cases import box_pile, run
motion = run(*box_pile(60, {static}), seconds=1.0)
print(hashlib.sha256(motion.positions.tobytes() + motion.rotations.tobytes()).hexdigest())
"""


@pytest.mark.slow
@needs_rapier
@pytest.mark.parametrize("static", ["0.5", "0.8"])
def test_threads_and_processes_change_no_number(static: str) -> None:
    found = set()
    for threads in ("1", "2", "5", "2"):
        environment = {**os.environ, "RAYON_NUM_THREADS": threads, "PYTHONHASHSEED": threads}
        command = [sys.executable, "-c", PILE.format(static=static)]
        found.add(subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, check=True).stdout)
    assert len(found) == 1


@pytest.mark.parametrize(
    ("materials", "needed", "differing"),
    [
        ([Material(), Material(restitution=0.5)], False, 0),
        ([Material(0.7, 0.5)], True, 0),
        ([Material(0.5, 0.5, 0.2, "multiply"), Material(0.5, 0.5, 0.2, "multiply")], False, 0),
        ([Material(0.2, 0.2, friction_combine="maximum")] + 9 * [Material(0.8, 0.8)], True, 1),
        ([Material(0.2, 0.2, restitution_combine="maximum"), Material(restitution=0.8)], True, 1),
    ],
)
def test_only_materials_that_rapier_combines_otherwise_have_hooks(
    materials: list[Material], needed: bool, differing: int
) -> None:
    pairs = MaterialPairs(materials)
    assert (pairs.need_hooks, len(pairs.differing)) == (needed, differing)
    assert all(materials.count(each) == 1 for each in pairs.differing), "the rarer of two"


@pytest.mark.parametrize("material", [Material(0.7, 0.5), Material(0.3, 0.6, 0, "multiply"), Material(0.9, 0.1)])
def test_one_sliding_collider_is_enough_for_alike_materials(material: Material) -> None:
    pairs = MaterialPairs([material] * 5)
    both = (material, material)
    assert pairs.rapier_coefficients(both, (False, False)) == pairs.coefficients(both, False)
    assert (
        pairs.rapier_coefficients(both, (True, False))
        == pairs.rapier_coefficients(both, (True, True))
        == pairs.coefficients(both, True)
    )


def _count_hooks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """A list that each call of a hook is added to."""
    asked: list[int] = []
    own = FrictionHooks.modify_solver_contacts

    def count(self: FrictionHooks, context: object) -> None:
        asked.append(1)
        own(self, context)

    monkeypatch.setattr(FrictionHooks, "modify_solver_contacts", count)
    return asked


@needs_rapier
def test_contacts_are_read_sixty_times_a_second_and_need_no_hooks(monkeypatch: pytest.MonkeyPatch) -> None:
    read, asked = [], _count_hooks(monkeypatch)
    own = SlipReader.find_slips

    def count(self: SlipReader, slow: Bools) -> dict[ColliderPair, Velocity]:
        read.append(1)
        return own(self, slow)

    monkeypatch.setattr(SlipReader, "find_slips", count)
    material = Material(0.9, 0.3)
    moving = body(Shape("box", (0.5, 0.5, 0.5)), (0, 0.25, 0), material=material, velocity=(4, 0, 0))
    run(ground(material), moving, seconds=1.0)
    assert (len(read), len(asked)) == (61, 0)


@needs_rapier
def test_a_box_that_slides_below_another_has_hooks(monkeypatch: pytest.MonkeyPatch) -> None:
    """It sticks to that above, and the ground has static friction, so the numbers of neither collider are right."""
    asked = _count_hooks(monkeypatch)
    material, box, x = Material(0.9, 0.3), Shape("box", (0.5, 0.5, 0.5)), (3.0, 0, 0)
    pair = [body(box, (0, y, 0), material=material, velocity=x) for y in (0.25, 0.75)]
    motion = run(ground(material), *pair, seconds=2.0)
    assert motion.positions[-1, 0, 0] == pytest.approx(9 / (2 * 0.3 * 9.81), rel=0.02)
    assert asked


@needs_rapier
def test_few_colliders_of_a_pile_have_hooks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rapier calls them for each pair of a collider, touching or not, which would triple the time of the pile."""
    asked = _count_hooks(monkeypatch)
    run(*box_pile(40, 0.8), seconds=1.0)
    assert 0 < len(asked) / 240 < 12 * MAX_HOOKED


@needs_rapier
def test_a_pile_with_static_friction_comes_to_rest_and_sleeps() -> None:
    motion = run(*box_pile(40, 0.8), seconds=6.0)
    assert (motion.positions[-1] == motion.positions[-2]).all()
