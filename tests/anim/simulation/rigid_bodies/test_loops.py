"""Loops of rigid bodies: refused, blended, or run until they repeat."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.errors import RangeError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.model import Clip, Interpolation, TimeAxis, Track
from anim.simulation.rigid_bodies.options import RigidOptions
from anim.simulation.rigid_bodies.simulate import (
    read_description,
    simulate_rigid_bodies,
)
from tests.anim.simulation.rigid_bodies.cases import collider, document, needs_rapier, node, path, simulate

pytestmark = needs_rapier
BALL: list[dict[str, Any]] = [{"type": "sphere", "sphere": {"radius": 0.5}}, {"type": "plane"}]
FALLING: dict[str, Any] = {"motion": {}, "collider": collider(0)}


PADDLE: list[dict[str, Any]] = [*BALL, {"type": "box"}]


def paddle(angle: float) -> tuple[Document, Clip]:
    """A ball on a box that goes up and down in 2 s, on a floor; the box leans by `angle` rad."""
    tilt = quaternion.from_rotation_vector(np.array([0, 0, angle])).tolist()
    box = node((0, 0, 0), collider=collider(2)) | {"rotation": tilt}
    made = document([node((0, 0.95, 0), **FALLING), box, node((0, -2, 0), collider=collider(1))], PADDLE)
    times = np.linspace(0, 2, 41)
    heights = 0.1 * np.sin(np.pi * times)
    values = np.stack([0 * heights, heights, 0 * heights], axis=1)
    return made, Clip("up", (Track(1, "translation", Interpolation.LINEAR, TimeAxis(times), values),))


def test_a_loop_of_bodies_that_only_fall_is_refused_with_advice() -> None:
    made = document([node((0, 1, 0), **FALLING), node(collider=collider(1))], BALL)
    with pytest.raises(RangeError, match="don't come back") as caught:
        simulate(made, duration=1.0, loop=True)
    assert "players repeat any clip" in str(caught.value.help)


def test_a_loop_that_does_not_repeat_is_blended_and_says_so() -> None:
    """The ball rolls off the paddle in the first round, and lies on the floor at the end of any other."""
    made, clip = paddle(0.3)
    scene = reader.scene(made)
    description = read_description(made, scene.skeleton)
    looped, once = (
        simulate_rigid_bodies(scene, clip, description, RigidOptions(duration=2.0, loop=loop)) for loop in (True, False)
    )
    np.testing.assert_allclose(path(looped, 0)[-1], path(looped, 0)[0], atol=1e-6)
    turned = path(looped, 0, "rotation")
    assert quaternion.angle_between(turned[-1], turned[0]) < 1e-6
    assert (looped.report.loop_seam_m or 0) > 0.1
    assert any("don't repeat their motion in 20 rounds" in note for note in looped.notes)
    assert np.linalg.norm(path(once, 0)[-1] - path(once, 0)[0]) > 0.5


def test_a_driven_loop_runs_until_it_repeats() -> None:
    """A paddle swings under a heavy ball on it: the ball's motion is that of the paddle in each round."""
    made = document([node((0, 0.75, 0), **FALLING), node((0, 0, 0), collider=collider(2))], [*BALL, {"type": "box"}])
    times, heights = np.linspace(0, 2, 41), 0.1 * np.sin(np.pi * np.linspace(0, 2, 41))
    values = np.stack([0 * heights, heights, 0 * heights], axis=1)
    clip = Clip("up", (Track(1, "translation", Interpolation.LINEAR, TimeAxis(times), values),))
    scene = reader.scene(made)
    run = simulate_rigid_bodies(
        scene, clip, read_description(made, scene.skeleton), RigidOptions(duration=2.0, loop=True)
    )
    assert 1 < run.report.figures["loop_rounds"] <= 20
    assert (run.report.loop_seam_m or 0) < 2e-3
