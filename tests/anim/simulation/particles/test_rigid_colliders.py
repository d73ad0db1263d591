"""Colliders of rigid bodies as obstacles of particles."""

from __future__ import annotations

import pytest

from anim.errors import DataRangeError
from anim.gltf.reading import reader
from anim.simulation.particles.obstacles import Sphere
from anim.simulation.particles.rigid_colliders import read_rigid_colliders
from tests.anim.simulation.rigid_bodies.cases import collider, document, node


def test_a_collider_beyond_the_limits_is_a_fault_of_the_file() -> None:
    scaled = node(collider=collider(0))
    made = document([scaled], [{"type": "sphere", "sphere": {"radius": 0.5}}])
    assert read_rigid_colliders(made, reader.skeleton(made)) == ([Sphere((0.0, 0.0, 0.0), 0.5, 0)], [])
    scaled["scale"] = [1e13] * 3
    huge = document([scaled], [{"type": "sphere", "sphere": {"radius": 0.5}}])
    with pytest.raises(DataRangeError, match=r"collider of node 0: `radius` is 5e\+12 m"):
        read_rigid_colliders(huge, reader.skeleton(huge))
