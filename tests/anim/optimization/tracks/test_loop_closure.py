"""Loops that were closed are closed to the bit, on what is read back from the written file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing.writer import replace_clips
from anim.maths import quaternion
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip, Track
from anim.optimization.optimize import optimize
from anim.optimization.options import Bounds, Drop, Packing, Policy, Request
from anim.optimization.tracks.clip_ends import close_ends, closure_signs, opened_tracks
from tests.clips import STEP, about, clip, track
from tests.files import glb_of, opened, opened_fixture

ZERO, ONE = [0.0, 0, 0], [1.0, 0, 0]
HERE, BACK, AWAY = [0.0, 0, 0, 1], [0.0, 0, 0, -1], [0.0, 0, 1, 0]


def _ends(track: Track) -> tuple[Floats, Floats]:
    return track.values[0], track.values[-1]


def _is_closed(track: Track) -> bool:
    first, last = _ends(track)
    return bool((first == last).all() or (track.path == "rotation" and (first == -last).all()))


def test_signs_of_closure() -> None:
    moves = np.array([[ZERO, ONE, ZERO], *[[ZERO, ONE, [0, 0, 1e-3]]] * 2, [ONE, ZERO, [-1.0, 0, 0]]])
    tolerances = np.array([0, 0, 2e-3, 0])
    assert closure_signs(moves, tolerances).tolist() == [1, 0, 1, 0]  # only rotations come back with another sign
    turns = np.array([[HERE, AWAY, HERE], [HERE, AWAY, BACK], [HERE, AWAY, AWAY], [HERE, AWAY, [0, 0, 1e-3, -1]]])
    assert closure_signs(turns, np.zeros(4)).tolist() == [1, -1, 0, 0]
    assert closure_signs(turns, np.full(4, 2e-3)).tolist() == [1, -1, 0, -1]


def test_ends_are_closed_in_the_middle() -> None:
    """Of tracks with fewer keys than there is room for, too: what lies after their last one stays."""
    keys = np.moveaxis(np.array([[ZERO, ONE, [0, 0.2, 0], ONE]] * 2 + [[ZERO, ONE, ONE, [0, 0.4, 0]]]), 2, 0)
    found = keys.copy()
    close_ends(found, np.array([1.0, 0.0, 1.0]), np.array([3, 3, 4]))
    assert found[:, 0].T.tolist() == [[0, 0.1, 0], ONE, [0, 0.1, 0], ONE]
    assert (found[:, 0, 0] == found[:, 0, 2]).all()
    assert (found[:, 1] == keys[:, 1]).all()
    assert found[:, 2].T.tolist() == [[0, 0.2, 0], ONE, ONE, [0, 0.2, 0]]
    turns = np.array([HERE, AWAY, (-about("z", 20.0)).tolist()]).T[:, None]
    close_ends(turns, np.array([-1.0]), np.array([3]))
    assert (turns[:, 0, -1] == -turns[:, 0, 0]).all()
    assert turns[:, 0, 0] == pytest.approx(about("z", 10.0))


def test_opened_tracks_are_those_that_closed_before() -> None:
    moving = track("translation", [0, 1, 2], [ZERO, ONE, ZERO])
    going = track("translation", [0, 1, 2], [ZERO, ONE, [2.0, 0, 0]], node=1)
    turning = track("rotation", [0, 1, 2], [HERE, AWAY, BACK], node=2)
    late = track("scale", [0.5, 1, 1.5], [ONE, ZERO, ONE], node=3)
    before = clip(moving, going, turning, late)
    assert opened_tracks(before, before) == []
    assert opened_tracks(before, clip(moving, going)) == []
    off = replace(turning, values=np.array([HERE, AWAY, about("z", 1e-6)]))
    assert opened_tracks(before, clip(moving, going, off, late)) == [(2, "rotation")]
    stepped = track("scale", [0, 1.9], [ONE, ZERO], STEP, node=3)
    assert opened_tracks(before, clip(moving, going, turning, stepped)) == [(3, "scale")]


def _busy(seed: int, joints: Sequence[int]) -> Clip:
    """A clip of the biped that closes to the bit, but for one joint: full turns, late tracks, and noise all along."""
    chance = np.random.default_rng(seed)
    times = np.linspace(0, 2, 49)
    swell = np.sin(np.pi * times / 2) ** 2
    swell[-1] = 0
    tracks = []
    for count, node in enumerate(joints):
        turns = np.cumsum(chance.normal(size=(49, 3)), axis=0) / 15 * swell[:, None]
        values = quaternion.from_rotation_vector(turns)
        if count % 4 == 1:  # once around: it comes back as −q
            values = quaternion.multiply(about("y", 360 * times / 2), values)
            values[-1] = -values[0]
        elif count % 4 == 2:  # open
            values = quaternion.multiply(values, about("x", 20 * times))
        at = times[3:-2] if count % 4 == 3 else times
        values = values[3:-2] if count % 4 == 3 else values
        if count % 4 == 3:
            values[-1] = values[0]
        tracks.append(track("rotation", at, values.astype(np.float32), node=node))
    return clip(*tracks, name="busy")


def _busy_document() -> Document:
    document = opened_fixture("biped")
    joints = reader.scene(document).instances[0].skin
    assert joints is not None
    new = replace_clips(document, {0: _busy(3, joints.joints[1:13].tolist())})
    return opened(glb_of(replace(new, json={**new.json, "animations": new.json["animations"][:1]})))


BUSY = _busy_document()


@pytest.mark.parametrize("effort", ["fast", "balanced"])
@pytest.mark.parametrize("share", [1e-2, 1e-3])
@pytest.mark.parametrize("packing", list(Packing))
def test_what_closed_is_closed_to_the_bit(packing: Packing, share: float, effort: str) -> None:
    scene, clips = reader.scene(BUSY), reader.clips(BUSY)
    diagonal = ErrorMetric(scene).diagonal
    bounds = Bounds(share * diagonal, 0.01 * diagonal)
    request = Request(bounds, packing=packing, effort=effort, policy=Policy(Drop.REST))
    found = optimize(BUSY, scene, clips, request)
    (after,) = reader.clips(opened(glb_of(found.document)))
    closed = {each.target for each in clips[0].tracks if _is_closed(each)}
    keyed = [each for each in after.tracks if len(each.times) > 1]
    assert len(closed) == 9
    assert len(keyed) > 6
    assert not found.without_loss
    for each in keyed:
        assert _is_closed(each) or each.target not in closed, (each.target, _ends(each))
