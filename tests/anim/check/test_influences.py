"""Fixes of joints and weights: measured with the new ones, and separate for each skin."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from anim.arrays import Floats
from anim.check.checked_file import CheckedFile
from anim.check.fixing import fix_all
from anim.check.selection import RuleSelection
from anim.gltf.document import Document
from anim.gltf.writing.append import VERTICES, append_accessors
from anim.measure.error.surface import place_points, surfaces
from anim.model import Clip
from anim.sampling.pose import PosedSkeleton, sample_pose
from tests.anim.check.cases import WRONG, checked, edited, selection, with_influences


def vertices(file: CheckedFile, clip: Clip, time: float) -> list[Floats]:
    """Return the vertices of each mesh at a time of a clip."""
    posed = PosedSkeleton(file.skeleton, sample_pose(file.skeleton, clip, np.array([time])))
    return [place_points(each, posed.world[each.nodes, 0], each.rest_weights) for each in surfaces(file.scene)]


def largest(one: CheckedFile, other: CheckedFile) -> float:
    """Return the largest distance of a vertex at 31 times of every clip."""
    moments = [(clip, t) for clip in one.contents.clips.values() for t in np.linspace(0, clip.end, 31)]
    pairs = (pair for at in moments for pair in zip(vertices(one, *at), vertices(other, *at), strict=True))
    return max(float(np.linalg.norm(a - b, axis=1).max()) for a, b in pairs)


def two_skins() -> Document:
    """Return the arm with two more meshes of a second skin; one of them has the joints' accessor of the arm's mesh.

    Of four joints both skins use the first and the last; only the second skin has vertices with the second.
    """
    document = edited(lambda json: None)
    (node,) = (node for node in document.json["nodes"] if "skin" in node)
    attributes = document.json["meshes"][node["mesh"]]["primitives"][0]["attributes"]
    count = document.json["accessors"][attributes["POSITION"]]["count"]
    rows = [np.zeros((count, 4), "u1") for _ in range(2)]
    rows[0][:, 0] = np.where(np.arange(count) % 2, 3, 0)
    rows[1][:, 0] = 1
    weights = np.tile(np.array([1, 0, 0, 0], "<f4"), (count, 1))
    document, (first, second, ones) = append_accessors(document, [(each, VERTICES) for each in (*rows, weights)])
    json = document.json
    attributes.update(JOINTS_0=first, WEIGHTS_0=ones)
    (skin,) = json["skins"]
    skin.pop("inverseBindMatrices", None)
    for _ in range(2):
        json["nodes"][skin["joints"][0]].setdefault("children", []).append(len(json["nodes"]))
        json["nodes"].append({"translation": [0, 0.3 * len(skin["joints"]), 0]})
        skin["joints"].append(len(json["nodes"]) - 1)
    json["skins"].append(copy.deepcopy(skin))
    for joints in (first, second):
        mesh = copy.deepcopy(json["meshes"][node["mesh"]])
        mesh["primitives"][0]["attributes"]["JOINTS_0"] = joints
        json["meshes"].append(mesh)
        json["nodes"].append({"name": f"copy {joints}", "mesh": len(json["meshes"]) - 1, "skin": 1})
        json["scenes"][0]["nodes"].append(len(json["nodes"]) - 1)
    return document


def test_unused_joints_are_removed_from_two_skins_that_use_one_accessor() -> None:
    file = checked(two_skins())
    result = fix_all(file, selection("GA213"), unsafe=True)
    assert [(each.rule.code, each.count, each.error_m) for each in result.applied] == [("GA213", 3, 0.0)]
    fixed = checked(result.document)
    assert [len(each["joints"]) for each in fixed.json["skins"]] == [2, 3]
    assert largest(file, fixed) == 0


def test_the_error_of_fewer_influences_is_measured_with_the_new_weights() -> None:
    broken = WRONG["GA201"][0]
    file = broken if isinstance(broken, CheckedFile) else checked(broken)
    one = RuleSelection(select=("GA201",), parameters={"GA201.influences": "1"})
    (applied,) = (result := fix_all(file, one, unsafe=True)).applied
    error = largest(file, checked(result.document))
    assert error > 1e-3
    assert applied.error_m >= error * (1 - 1e-9)
    assert applied.error_m == pytest.approx(error, rel=0.1)


def test_a_joint_in_two_sets_stays_in_one() -> None:
    """glTF forbids two influences of one joint on a vertex."""
    file = checked(with_influences([[0, 1, 0, 1], [1, 0, 0, 0]], [[0.3, 0.2, 0.2, 0.2], [0.1, 0.0, 0.0, 0.0]]))
    result = fix_all(file, selection("GA201"), unsafe=True)
    (instance,) = checked(result.document).scene.instances
    assert instance.mesh.weights[0] == pytest.approx([0.5, 0.5, 0, 0])
    assert instance.mesh.joints[0].tolist() == [0, 1, 0, 0]
    assert result.applied[0].error_m < 1e-6
