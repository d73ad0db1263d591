"""A motion put on a character: whose joints those are, and what becomes of the file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.errors import NotFoundError
from anim.exchange.euler.curve import linear
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import EulerMotion, EulerNode
from anim.exchange.retarget.apply import apply_to_character
from anim.gltf import authoring
from anim.gltf.reading import reader
from anim.maths.euler import AxesConvention
from anim.model import Scene
from tests.anim.exchange.figures import Find, put_on, recorded, tail
from tests.clips import skeleton
from tests.files import glb_of, opened, opened_fixture, opened_path


def test_the_clip_is_added_and_nothing_else(asset: Find) -> None:
    document = opened_fixture("biped")
    done = put_on(document, recorded("cmu_01_01.bvh", asset), {})
    written = opened(glb_of(authoring.add_clips(document, [done.clip])))
    assert [clip.name for clip in reader.clips(written)] == ["walk", "wave", "jump", "cmu"]
    for key in ("nodes", "meshes", "skins", "materials", "scenes"):
        assert written.json[key] == document.json[key]


def test_curves_without_a_hierarchy_are_the_nodes_own() -> None:
    curve = linear(np.array((0.0, 1.0)), np.array((0.0, 0.5)))
    node = EulerNode("tail2", -1, np.zeros(3), "Z", AxesConvention.INTRINSIC, np.zeros(1), (curve,))
    source = from_euler(EulerMotion((node,), nested=False), tolerance=1e-4)
    done = apply_to_character(source, Scene(tail(np.array((0, 0, 0, 1.0))), ()), aliases={}, nested=False)
    assert [(track.node, track.path) for track in done.clip.tracks] == [(1, "rotation")]


def test_strangers_are_refused() -> None:
    node = EulerNode(
        "wing", -1, np.zeros(3), "Z", AxesConvention.INTRINSIC, np.zeros(1), (linear(np.zeros(1), np.zeros(1)),)
    )
    source = from_euler(EulerMotion((node,)), tolerance=1e-4)
    with pytest.raises(NotFoundError, match="no joint of the motion"):
        apply_to_character(source, Scene(tail(np.array((0, 0, 0, 1.0))), ()), aliases={}, nested=True)
    with pytest.raises(NotFoundError, match="the character has no nodes"):
        apply_to_character(source, Scene(skeleton([]), ()), aliases={}, nested=True)


def test_the_example_pairs_the_topmost_joints() -> None:
    node = EulerNode(
        "wing", -1, np.zeros(3), "Z", AxesConvention.INTRINSIC, np.zeros(1), (linear(np.zeros(1), np.zeros(1)),)
    )
    source = from_euler(EulerMotion((node,)), tolerance=1e-4)
    character = replace(skeleton([1, -1]), names=("socket", "body"))
    with pytest.raises(NotFoundError) as caught:
        apply_to_character(source, Scene(character, ()), aliases={}, nested=True)
    assert caught.value.help.endswith("'wing,body'")


def test_limbs_that_the_skin_lacks_are_moved(asset: Find) -> None:
    """A file that holds the skin of a head, and joints of a whole person."""
    document = opened_path(asset("BitmojiRun.glb"))
    done = put_on(document, recorded("freebvh.bvh", asset), {})
    names = reader.skeleton(document).names
    found = {names[node] for node in done.matching.target_roles.values()}
    for side in "LR":
        parts = ("clavicle", "armUpper0001", "armLower0001", "hand0001", "legUpper0001", "legLower0001", "foot0001")
        assert {f"{side}_{part}_bind_JNT" for part in parts} <= found
    assert len(done.matching.pairs) >= 30
