"""Limit of distances in a scene, which float32 can't hold."""

from __future__ import annotations

import numpy as np
import pytest

from anim.errors import UnsupportedError
from anim.gltf.reading import reader
from anim.model import Clip, Track
from anim.simulation.rigid_bodies.options import RigidOptions
from anim.simulation.rigid_bodies.simulate import read_description, simulate_rigid_bodies
from tests.anim.simulation.rigid_bodies.cases import collider, document, needs_rapier, node, simulate

BALL = [{"type": "sphere", "sphere": {"radius": 0.5}}]


@needs_rapier
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_body_far_from_the_others_is_refused(axis: int) -> None:
    place = 1e16 * np.eye(3)[axis]
    made = document([node(motion={}, collider=collider(0)), node(place.tolist(), collider=collider(0))], BALL)
    with pytest.raises(
        UnsupportedError, match=r"node 1 is 1e\+13 km away from the middle .* \(limit 10 000 km"
    ) as caught:
        simulate(made, duration=0.1)
    assert caught.value.help == "move it nearer, or leave it out of the bodies"


@needs_rapier
def test_bodies_far_from_the_origin_are_simulated() -> None:
    places = [(1e6, 0.0, 0.0), (1e6 + 5e4, 0.0, 0.0)]
    made = document([node(place, motion={}, collider=collider(0)) for place in places], BALL)
    assert simulate(made, duration=0.1).tracks


@needs_rapier
def test_a_clip_that_moves_a_body_far_away_is_refused() -> None:
    made = document(
        [node(motion={}, collider=collider(0)), node(motion={"isKinematic": True}, collider=collider(0))], BALL
    )
    track = Track(1, "translation", "LINEAR", np.array([0.0, 0.1]), np.array([[0.0, 3, 0], [0, 1e12, 0]]))
    scene = reader.scene(made)
    description = read_description(made, scene.skeleton)
    with pytest.raises(UnsupportedError, match=r"node 1 is .* km away from"):
        simulate_rigid_bodies(scene, Clip("far", (track,)), description, RigidOptions(duration=0.1))
