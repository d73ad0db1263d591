"""Names of joints across tools."""

from __future__ import annotations

from typing import Any

import pytest

from anim.errors import FormatError, NotFoundError
from anim.exchange.retarget import joint_matching
from anim.exchange.retarget.joint_matching import JointMatch, match_joints
from anim.exchange.retarget.joint_names import JointName, normalize_names
from anim.exchange.retarget.joint_roles import MIDDLE, SIDED, joint_roles, read_vrm_roles
from tests.anim.exchange.figures import Find
from tests.files import opened_path

CMU = ("Hips", "LHipJoint", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "RHipJoint", "RightUpLeg", "RightLeg",
       "RightFoot", "RightToeBase", "LowerBack", "Spine", "Spine1", "Neck", "Head", "LeftShoulder", "LeftArm",
       "LeftForeArm", "LeftHand", "RightShoulder", "RightArm", "RightForeArm", "RightHand", "LThumb")  # fmt: skip
BIPED = ("Bip01", "Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine1", "Bip01 Neck", "Bip01 Head", "Bip01 L Clavicle",
         "Bip01 L UpperArm", "Bip01 L Forearm", "Bip01 L Hand", "Bip01 L Thigh", "Bip01 L Calf", "Bip01 L Foot",
         "Bip01 L Toe0", "Bip01 R Clavicle", "Bip01 R UpperArm", "Bip01 R Forearm", "Bip01 R Hand", "Bip01 R Thigh",
         "Bip01 R Calf", "Bip01 R Foot", "Bip01 R Toe0")  # fmt: skip
KAYKIT = ("hips", "spine", "chest", "head", "upperarm.l", "lowerarm.l", "wrist.l", "hand.l", "upperarm.r", "lowerarm.r",
          "wrist.r", "hand.r", "upperleg.l", "lowerleg.l", "foot.l", "toes.l", "upperleg.r", "lowerleg.r", "foot.r",
          "toes.r")  # fmt: skip
MIXAMO = tuple(f"mixamorig:{name}" for name in CMU if name not in ("LHipJoint", "RHipJoint", "LowerBack", "LThumb"))
UNREAL = ("root", "pelvis", "spine_01", "spine_02", "spine_03", "neck_01", "head",
          *(f"{name}_{side}" for side in "lr" for name in ("clavicle", "upperarm", "lowerarm", "hand", "thigh", "calf",
            "foot", "ball", "thumb_01")))  # fmt: skip
RIGIFY = ("root", "DEF-spine", "DEF-spine.001", "DEF-spine.002", "DEF-spine.003", "DEF-spine.004", "DEF-spine.006",
          *(f"{kind}-{name}.{side}" for kind in ("ORG", "MCH", "DEF") for side in "LR" for name in ("shoulder",
            "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe")), "DEF-thigh.L.001")  # fmt: skip
VROID = ("Root", *(f"J_Bip_C_{name}" for name in ("Hips", "Spine", "Chest", "UpperChest", "Neck", "Head")),
         *(f"J_Bip_{side}_{name}" for side in "LR" for name in ("Shoulder", "UpperArm", "LowerArm", "Hand", "UpperLeg",
           "LowerLeg", "Foot", "ToeBase")), "J_Sec_Hair1_01", "J_Sec_Hair2_01")  # fmt: skip
DAZ = ("hip", "pelvis", "abdomenLower", "chestLower", "neckLower", "head",
       *(f"{side}{name}" for side in "lr" for name in ("ThighBend", "ThighTwist", "Shin", "Foot", "Toe", "Collar",
         "ShldrBend", "ShldrTwist", "ForearmBend", "Hand")))  # fmt: skip
READY_PLAYER_ME = tuple(name for name in CMU if name not in ("LHipJoint", "RHipJoint", "LowerBack", "LThumb"))
BARE_MIXAMO = tuple(f"mixamorig{name}" for name in READY_PLAYER_ME)
SKETCHFAB = tuple(f"{name}_{number:03}" for number, name in enumerate(RIGIFY))
ARMATURE = tuple(f"{name}_Armature" for name in KAYKIT)
COUNTED = tuple(f"{name}_{number:02}" for number, name in enumerate(ARMATURE))
BITMOJI = (*(f"C_{name}_bind_JNT" for name in ("spine0001", "spine0002", "spine0006", "neck0001", "neck0002",
             "head0001", "jaw")),
           *(f"{side}_{name}_bind_JNT" for side in "LR" for name in ("eye_Socket", "clavicle", "armUpper0001",
             "armUpper0003", "armLower0001", "hand0001", "handThumb0001", "handThumb0002", "handPinky0002",
             "handPointer0002", "armLower0003", "legUpper0001", "legLower0001", "foot0001", "foot0002")))  # fmt: skip
PEOPLE = {"cmu": CMU, "biped": BIPED, "kaykit": KAYKIT, "mixamo": MIXAMO, "unreal": UNREAL, "rigify": RIGIFY,
          "vroid": VROID, "daz": DAZ, "ready player me": READY_PLAYER_ME, "mixamo, no colon": BARE_MIXAMO,
          "sketchfab": SKETCHFAB, "armature": ARMATURE, "armature, counted": COUNTED, "bitmoji": BITMOJI,
          "mixamo 1": tuple(name.replace(":", "1:") for name in MIXAMO)}  # fmt: skip
LIMBS = {f"{side}_{role}" for side in ("left", "right") for role in SIDED if role != "shoulder"}


def _match(source: tuple[str, ...], target: tuple[str, ...], **names: str) -> JointMatch:
    return match_joints(source, target, aliases=names, of_source=range(len(source)), of_target=range(len(target)))


def _pairs(source: tuple[str, ...], target: tuple[str, ...]) -> dict[str, str]:
    return {source[a]: target[b] for a, b in _match(source, target).pairs.items()}


@pytest.mark.parametrize(
    ("name", "side", "stem"),
    [
        ("mixamorig:LeftUpLeg", "left", "upleg"),
        ("left_upper_leg", "left", "upperleg"),
        ("UpperArm.R", "right", "upperarm"),
        ("LHipJoint", "left", "hipjoint"),
        ("rShldr", "right", "shldr"),
        ("Spine01", "", "spine1"),
        ("hips", "", "hips"),
        ("Ребро", "", "ребро"),
    ],
)
def test_a_name_is_taken_apart(name: str, side: str, stem: str) -> None:
    assert normalize_names([name]) == [JointName(side, stem)]


def test_a_shared_prefix_goes() -> None:
    assert normalize_names(BIPED)[10] == JointName("left", "thigh")
    assert normalize_names(["left_arm", "left_leg", "left_foot"])[0] == JointName("left", "arm")
    assert normalize_names(["Tail.1", "Tail.2", "Tail.L"]) == [
        JointName("", "tail1"),
        JointName("", "tail2"),
        JointName("left", "tail"),
    ]


@pytest.mark.parametrize("names", PEOPLE.values(), ids=PEOPLE)
def test_the_joints_of_a_person_are_found(names: tuple[str, ...]) -> None:
    found = joint_roles(normalize_names(names), range(len(names)))
    assert found.keys() >= LIMBS | {"hips", "chest", "head"}
    assert "spine" in found or names is BITMOJI  # whose second is the chest
    assert len(set(found.values())) == len(found)
    assert set(found) <= {*MIDDLE, *LIMBS, "left_shoulder", "right_shoulder"}


@pytest.mark.parametrize("target", [BIPED, KAYKIT, MIXAMO], ids=["biped", "kaykit", "mixamo"])
def test_cmu_fits_each(target: tuple[str, ...]) -> None:
    pairs = _pairs(CMU, target)
    assert len(pairs) >= 18
    assert len(set(pairs.values())) == len(pairs)
    assert normalize_names(target)[target.index(pairs["LeftLeg"])].side == "left"
    assert _match(CMU, target).unmatched


def test_names_of_the_deforming_joints_are_taken() -> None:
    found = joint_roles(normalize_names(SKETCHFAB), range(len(SKETCHFAB)))
    assert {SKETCHFAB[node][:4] for node in found.values()} == {"DEF-"}
    assert SKETCHFAB[found["left_upper_leg"]].startswith("DEF-thigh.L_")
    assert RIGIFY[found["hips"]] == "DEF-spine"


def test_numbers_that_tell_joints_apart_stay() -> None:
    assert normalize_names(["Tail_01", "Tail_02", "Tail_03"]) == [JointName("", f"tail{i}") for i in (1, 2, 3)]


NAMED_BADLY = ("a", "b", "LeftHand", "d")


@pytest.mark.parametrize(
    "extensions",
    [
        {"VRM": {"humanoid": {"humanBones": [{"bone": "hips", "node": 1}, {"bone": "leftUpperArm", "node": 2}]}}},
        {"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 1}, "leftUpperArm": {"node": 2}}}}},
        {"VRMC_vrm_animation": {"humanoid": {"humanBones": {"hips": {"node": 1}, "leftUpperArm": {"node": 2}}}}},
    ],
    ids=["0.x", "1.0", "animation"],
)
def test_stated_roles_win_over_names(extensions: dict[str, Any]) -> None:
    stated = read_vrm_roles({"nodes": [{}] * 4, "extensions": extensions})
    assert stated == {"hips": 1, "left_upper_arm": 2}
    source = ("Hips", "LeftArm", "LeftHand")
    found = match_joints(source, NAMED_BADLY, aliases={}, of_source=range(3), of_target=range(4), stated=stated)
    assert found.pairs == {0: 1, 1: 2}
    assert found.target_roles == {"hips": 1, "left_upper_arm": 2}


@pytest.mark.parametrize("bones", [3, [4], {"hips": 1}, {"hips": {"node": 9}}, {"hips": {"node": True}}, None])
def test_what_is_no_humanoid_states_nothing(bones: Any) -> None:
    extensions = {"VRMC_vrm": {"humanoid": {"humanBones": bones}}}
    assert read_vrm_roles({"nodes": [{}], "extensions": extensions}) == {}


@pytest.mark.parametrize("name", ["vrm/Godette.vrm", "vrm/test.vrma"])
def test_real_files_state_a_whole_person(name: str, asset: Find) -> None:
    json = opened_path(asset(name)).json
    stated = read_vrm_roles(json)
    assert stated.keys() >= LIMBS - {"left_toe", "right_toe"} | {"hips", "spine", "chest", "neck", "head"}
    assert len(set(stated.values())) == len(stated)


def test_the_parts_of_a_limb_are_told_apart() -> None:
    """By which half they are of, and by the first number of a row."""
    pairs = _pairs(MIXAMO, BITMOJI)
    ends = {"Hips": "C_spine0001", "Head": "C_head0001", "LeftArm": "L_armUpper0001", "LeftForeArm": "L_armLower0001",
            "LeftHand": "L_hand0001", "RightUpLeg": "R_legUpper0001", "RightLeg": "R_legLower0001",
            "RightFoot": "R_foot0001", "RightToeBase": "R_foot0002", "RightShoulder": "R_clavicle"}  # fmt: skip
    assert {name: pairs[f"mixamorig:{name}"] for name in ends} == {a: f"{b}_bind_JNT" for a, b in ends.items()}


def test_joints_of_the_skin_come_before_other_nodes() -> None:
    target = ("Hips", "rig:pelvis", "LeftFoot", "foot.l")
    source = ("Hips", "LeftFoot", "RightFoot")
    found = match_joints(source, target, aliases={}, of_source=range(3), of_target=(1,), others=(0, 2, 3))
    assert found.pairs == {0: 1, 1: 2}


def test_kaykit_in_words() -> None:
    pairs = _pairs(CMU, KAYKIT)
    assert pairs["LeftLeg"] == "lowerleg.l"
    assert pairs["LeftArm"] == "upperarm.l"
    assert pairs["LeftHand"] == "hand.l"
    assert pairs["Spine1"] == "chest"
    assert "LHipJoint" not in pairs


def test_an_alias_comes_first_and_can_leave_out() -> None:
    found = _match(("a", "b", "c"), ("a", "b", "c"), a="c", b="")
    assert found.pairs == {0: 2}
    assert found.unmatched == (1, 2)


def test_an_alias_of_nothing_is_refused() -> None:
    with pytest.raises(NotFoundError, match="alias for 'LeftArn'") as caught:
        _match(CMU, KAYKIT, LeftArn="upperarm.l")
    assert "LeftArm" in caught.value.help
    with pytest.raises(NotFoundError, match=r"'LeftArm' → 'upperam.l', which is not there"):
        _match(CMU, KAYKIT, LeftArm="upperam.l")


def test_alias_files() -> None:
    expected = {"LeftArm": "upperarm.l", "LFingers": ""}
    assert joint_matching.read_aliases(b"# arms\nLeftArm, upperarm.l\n\nLFingers,\n") == expected
    assert joint_matching.read_aliases(b'{"LeftArm": "upperarm.l", "LFingers": ""}') == expected
    with pytest.raises(FormatError, match="line 2: 3 columns"):
        joint_matching.read_aliases(b"a,b\na,b,c\n")
    with pytest.raises(FormatError, match="'a' has 1"):
        joint_matching.read_aliases(b'{"a": 1}')
    with pytest.raises(FormatError, match="line 2: broken CSV"):
        joint_matching.read_aliases(b'a,b\nc,"d')
