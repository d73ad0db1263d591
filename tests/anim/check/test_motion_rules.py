"""Rules on motion: planted faults are found, and the smooth motion that they were planted in is clean."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.check.find import find_all, occurrences
from anim.check.finding import Finding
from anim.check.selection import RuleSelection
from anim.model import Track
from tests.anim.check.cases import (
    FRAMES,
    checked,
    flipped_spline,
    found,
    jump,
    pop,
    rotation,
    selection,
    step_of,
    tremble,
    with_tracks,
)
from tests.anim.check.json_faults import ARM_JOINTS
from tests.clips import track
from tests.files import opened_fixture

Plant = Callable[[Floats], Floats]


def swing(plant: Plant = lambda degrees: degrees) -> Track:
    """Return a joint that swings about X by 30°, with a planted fault, and with random signs."""
    degrees = plant(30 * np.sin(FRAMES / 6))
    values = Rotation.from_euler("x", degrees[:, None], degrees=True).as_quat()
    signs = np.where(np.random.default_rng(1).random(len(values)) < 0.5, -1.0, 1.0)
    joint = opened_fixture("arm").json["skins"][0]["joints"][1]
    return track("rotation", FRAMES / 30, values * signs[:, None], node=joint)


@pytest.mark.parametrize(("code", "plant"), [("GA301", pop), ("GA302", jump), ("GA303", tremble)])
def test_planted_faults_are_found(code: str, plant: Plant) -> None:
    def run(fault: Plant) -> list[Finding]:
        return found(with_tracks(swing(fault)), code)

    assert len(run(plant)) == 1
    assert run(lambda degrees: degrees) == []
    others = {"GA301": jump, "GA302": pop, "GA303": jump}
    assert run(others[code]) == []


@pytest.mark.parametrize(
    ("code", "tracks", "frame"),
    [
        ("GA301", [swing(pop)], 20),
        ("GA302", [swing(jump)], 20),
        ("GA303", [swing(tremble)], 11),
        ("GA101", [rotation(0, 10, 185)], 60),
        ("GA103", [rotation(0, 10, 20, sign=-1.0)], 60),
        ("GA120", [flipped_spline()], None),
    ],
)
def test_motion_has_a_time_and_a_node(code: str, tracks: list[Track], frame: int | None) -> None:
    ((_, (occurrence, *_)),) = occurrences(checked(with_tracks(*tracks)), selection(code))
    assert occurrence.node == ARM_JOINTS[1]
    assert occurrence.time_s is not None
    if frame is not None:
        assert abs(occurrence.time_s * 30 - frame) < 1.1


@pytest.mark.parametrize(("angle", "count"), [("13deg", 0), ("5deg", 1), ("0.0873rad", 1)])
def test_parameters_have_units(angle: str, count: int) -> None:
    assert len(found(with_tracks(swing(pop)), "GA301", angle=angle)) == count


def test_a_loop_that_creeps_is_found() -> None:
    file = checked(opened_fixture("arm"))
    root, way = file.joints[0], np.linspace(0, 1, 5)[:, None] * [0.02 * file.diagonal, 0, 0]
    findings = found(with_tracks(track("translation", np.arange(5) / 4, way, node=root)), "GA305")
    assert [each.problem for each in findings] == ["the root moves by 2 % of the model's size each time round"]
    assert found(with_tracks(track("translation", np.arange(5) / 4, 0 * way, node=root)), "GA305") == []
    assert found(with_tracks(track("translation", np.arange(5) / 4, 20 * way, node=root)), "GA305") == []


def test_feet_of_a_file_without_skins_slide_too() -> None:
    """Captured motion often comes as nodes alone."""
    document = step_of(1.0)
    for node in document.json["nodes"]:
        node.pop("skin", None)
        node.pop("mesh", None)
    del document.json["skins"], document.json["meshes"]
    assert len(found(document, "GA304")) == 1


def test_wide_steps_for_nlerp_and_stretched_joints() -> None:
    joint = opened_fixture("arm").json["skins"][0]["joints"][1]
    half = np.sqrt(0.5)
    turn = track("rotation", [0, 1], [[0.0, 0.0, 0.0, 1.0], [half, 0.0, 0.0, half]], node=joint)
    assert found(with_tracks(turn), "GA102")
    assert "clip 'walk'" not in {each.where for each in found(with_tracks(swing()), "GA102")}
    assert found(with_tracks(track("translation", [0, 1], [[0.0, 1, 0], [0.0, 2, 0]], node=joint)), "GA212")
    assert found(with_tracks(swing()), "GA212") == []


def test_they_are_off_unless_selected_or_the_target_needs_them() -> None:
    file = checked(with_tracks(swing(pop)))
    assert "GA301" not in {each.code for each in find_all(file)}
    assert "GA301" in {each.code for each in find_all(file, RuleSelection(extend=("GA301",)))}
    assert "GA102" in {rule.code for rule in RuleSelection(target="unity").rules()}
    assert "GA102" not in {rule.code for rule in RuleSelection().rules()}
