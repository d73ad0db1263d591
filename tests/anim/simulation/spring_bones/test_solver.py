"""Spring bones against a plain loop of the specification, and against three-vrm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fixtures
from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Pose
from anim.sampling.pose import sample_pose
from anim.sampling.world import world_by_node
from anim.simulation.spring_bones.solver import SpringSolver
from tests import three_vrm
from tests.anim.simulation.spring_bones.cases import ROOT, STEP, Case, chord, swaying
from tests.files import opened, opened_fixture, opened_path
from tests.three_vrm import needs_three_vrm

TOLERANCE = 1e-9  # of a quaternion's component
GODETTE = "vrm/Godette.vrm"


@pytest.fixture(scope="module")
def case() -> Case:
    return swaying(opened_fixture("springs"))


@pytest.fixture
def godette(asset: Callable[[str], Path]) -> tuple[Path, Case]:
    path = asset(GODETTE)
    return path, swaying(opened_path(path))


@pytest.mark.slow
def test_all_chains_agree_with_the_plain_loop(case: Case) -> None:
    motion = case.simulate()
    assert len(case.bones.nodes) == 41
    assert chord(case.bones.nodes, motion.rotations, *case.plain(faults=False)) < TOLERANCE


@pytest.mark.slow
def test_animated_scales_and_lengths_agree_with_the_plain_loop(case: Case) -> None:
    """Uneven scales above chains, and joints and tails that move away from their parents."""
    swell = 1 + 0.3 * np.sin(3 * case.times)
    stretch = np.stack([swell, 2 - swell, np.full_like(swell, 0.8)], axis=-1)
    names = case.skeleton.names
    others = {(names.index("half"), "scale"): stretch, (names.index("c1j1"), "scale"): stretch}
    for name in ("c0j0", "c0j3", "c3j1", "c5j2", "c7j4"):  # first, inner, skipped and last nodes of chains
        node = names.index(name)
        others[node, "translation"] = case.skeleton.translation[node] * swell[:, None]
    own = replace(case, others=others)
    assert chord(own.bones.nodes, own.simulate().rotations, *own.plain(faults=False)) < TOLERANCE
    assert chord(own.bones.nodes, own.simulate().rotations, list(own.bones.nodes), case.simulate().rotations) > 0.01


@pytest.mark.slow
def test_vrm_0_agrees_with_the_plain_loop(godette: tuple[Path, Case]) -> None:
    _, case = godette
    assert len(case.bones.nodes) == 16
    assert chord(case.bones.nodes, case.simulate().rotations, *case.plain(faults=False)) < TOLERANCE


def test_the_chains_swing_and_collide(case: Case) -> None:
    motion = case.simulate()
    rest = case.skeleton.rotation[list(case.bones.nodes)]
    assert np.degrees(quaternion.angle_between(motion.rotations, rest)).max(axis=0).min() > 0.3
    extension = case.document.json["extensions"]["VRMC_springBone"]
    free = [{key: value for key, value in each.items() if key != "colliderGroups"} for each in extension["springs"]]
    json = {**case.document.json, "extensions": {"VRMC_springBone": {**extension, "springs": free}}}
    loose = replace(case, document=replace(case.document, json=json)).simulate()
    apart = np.abs(loose.tails - motion.tails).max(axis=(0, 2))
    nodes = list(case.bones.nodes)
    for chain in (*case.bones.chains[:5], case.bones.chains[9]):
        assert apart[[nodes.index(joint.node) for joint in chain.joints]].max() > 0.01, chain.name


@pytest.mark.slow
@needs_three_vrm
def test_the_fixture_as_three_vrm_computes(case: Case, tmp_path: Path) -> None:
    """three-vrm as it is, against the plain loop with its two faults; which without them is ours."""
    nodes, frames = _played(fixtures.build("springs"), case, tmp_path, cured=False)
    mine = case.plain(faults=True)
    assert chord(tuple(mine[0]), mine[1], nodes, frames) < TOLERANCE
    assert chord(tuple(mine[0]), mine[1], *case.plain(faults=False)) > 0.5  # its faults show


@needs_three_vrm
@pytest.mark.parametrize("step", [1 / 60, 1 / 144, 1 / 24])
def test_the_fixture_as_three_vrm_cured(step: float, case: Case, tmp_path: Path) -> None:
    case = replace(case, step=step)
    nodes, frames = _played(fixtures.build("springs"), case, tmp_path, cured=True)
    assert chord(case.bones.nodes, case.simulate().rotations, nodes, frames) < TOLERANCE


@needs_three_vrm
@pytest.mark.parametrize("cured", [False, True])
def test_a_real_vrm_0_file_as_three_vrm_computes(godette: tuple[Path, Case], *, cured: bool) -> None:
    path, case = godette
    nodes, frames = three_vrm.play(path, {ROOT: (case.positions, case.rotations)}, STEP, cured=cured)
    assert chord(case.bones.nodes, case.simulate().rotations, nodes, frames) < TOLERANCE


def _played(data: bytes, case: Case, folder: Path, *, cured: bool) -> tuple[list[int], Floats]:
    file = folder / "springs.glb"
    file.write_bytes(data)
    return three_vrm.play(file, {ROOT: (case.positions, case.rotations)}, case.step, cured=cured)


def test_runs_continue_where_the_last_one_ended(case: Case) -> None:
    whole = case.simulate()
    solver = SpringSolver(case.skeleton, case.clip, case.bones, step=STEP)
    solver.start(0.0)
    parts = [solver.run(case.times[:100]), solver.run(case.times[100:])]
    np.testing.assert_array_equal(np.concatenate([part.rotations for part in parts]), whole.rotations)


def test_tails_are_where_the_rotations_put_them(case: Case) -> None:
    """Forward kinematics of the rotations gives the tails: lengths are kept, also below a scale."""
    motion, skeleton, bones = case.simulate(), case.skeleton, case.bones
    pose = sample_pose(skeleton, case.clip, case.times)
    rotation = pose.rotation.copy()
    rotation[:, list(bones.nodes)] = motion.rotations
    world = world_by_node(skeleton, Pose(pose.times, pose.translation, rotation, pose.scale))
    joints = [joint for chain in bones.chains for joint in chain.joints]
    for j, joint in enumerate(joints):
        assert joint.tail is not None
        np.testing.assert_allclose(motion.tails[:, j], world[joint.tail, :, :, 3], atol=1e-12)


def test_the_file_is_read_again_alike() -> None:
    assert swaying(opened(fixtures.build("springs"))).bones == swaying(opened_fixture("springs")).bones
