"""Names of joints across tools."""

from __future__ import annotations

import pytest

from anim.errors import FormatError, NotFoundError
from anim.exchange import aliases
from anim.exchange.match import Matching, match
from anim.exchange.names import Name, plain
from anim.exchange.roles import MIDDLE, SIDED, roles

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
LIMBS = {f"{side}_{role}" for side in ("left", "right") for role in SIDED if role != "shoulder"}


def _match(source: tuple[str, ...], target: tuple[str, ...], **names: str) -> Matching:
    return match(source, target, aliases=names, of_source=range(len(source)), of_target=range(len(target)))


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
    assert plain([name]) == [Name(side, stem)]


def test_a_shared_prefix_goes() -> None:
    assert plain(BIPED)[10] == Name("left", "thigh")
    assert plain(["left_arm", "left_leg", "left_foot"])[0] == Name("left", "arm")
    assert plain(["Tail.1", "Tail.2", "Tail.L"]) == [Name("", "tail1"), Name("", "tail2"), Name("left", "tail")]


@pytest.mark.parametrize("names", [CMU, BIPED, KAYKIT, MIXAMO], ids=["cmu", "biped", "kaykit", "mixamo"])
def test_the_joints_of_a_person_are_found(names: tuple[str, ...]) -> None:
    found = roles(plain(names), range(len(names)))
    assert found.keys() >= LIMBS | {"hips", "spine", "chest", "head"}
    assert len(set(found.values())) == len(found)
    assert set(found) <= {*MIDDLE, *LIMBS, "left_shoulder", "right_shoulder"}


@pytest.mark.parametrize("target", [BIPED, KAYKIT, MIXAMO], ids=["biped", "kaykit", "mixamo"])
def test_cmu_fits_each(target: tuple[str, ...]) -> None:
    pairs = _pairs(CMU, target)
    assert len(pairs) >= 18
    assert len(set(pairs.values())) == len(pairs)
    assert plain(target)[target.index(pairs["LeftLeg"])].side == "left"
    assert _match(CMU, target).unmatched


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
    assert aliases.read(b"# arms\nLeftArm, upperarm.l\n\nLFingers,\n") == expected
    assert aliases.read(b'{"LeftArm": "upperarm.l", "LFingers": ""}') == expected
    with pytest.raises(FormatError, match="line 2: 3 columns"):
        aliases.read(b"a,b\na,b,c\n")
    with pytest.raises(FormatError, match="'a' has 1"):
        aliases.read(b'{"a": 1}')
    with pytest.raises(FormatError, match="line 2: broken CSV"):
        aliases.read(b'a,b\nc,"d')
