"""Body roles of joint names, by the vocabulary of tools for human skeletons."""

from __future__ import annotations

from collections.abc import Sequence

from anim.exchange.retarget.joint_names import JointName

# Stems by role, the most certain first: CMU, Mixamo, Biped (3ds Max), Rigify, Unreal, VRM, Poser, KayKit, Quaternius,
# Daz; last Rigify's own names, with a spine that begins at the hips, as in skeletons with numbered spines.
MIDDLE = {
    "hips": ("hips", "pelvis", "hip", "spine", "spine1"),
    "spine": ("spine", "spine1", "abdomen", "abdomenlower", "lowerback", "waist", "torso"),
    "chest": ("chest", "upperchest", "spine3", "spine2", "spine1", "chestlower", "thorax", "ribcage", "torso"),
    "neck": ("neck", "neck1", "necklower", "spine4"),
    "head": ("head", "head1", "spine6"),
}
SIDED = {
    "shoulder": ("shoulder", "collar", "clavicle", "collarbone"),
    "upper_arm": ("upperarm", "uparm", "arm", "shldr", "shldrbend", "armupper", "armupper1", "bicep"),
    "lower_arm": ("lowerarm", "lowarm", "forearm", "forearmbend", "elbow", "armlower", "armlower1"),
    "hand": ("hand", "hand1", "wrist"),
    "upper_leg": ("upperleg", "upleg", "thigh", "thighbend", "hip", "legupper", "legupper1"),
    "lower_leg": ("lowerleg", "lowleg", "leg", "shin", "calf", "knee", "leglower", "leglower1"),
    "foot": ("foot", "foot1", "ankle"),
    "toe": ("toes", "toe", "toebase", "ball", "toe0", "foot2"),
}
PERSON = ("hips", "left_upper_leg", "right_upper_leg", "left_foot", "right_foot")


def joint_roles(names: Sequence[JointName], chosen: Sequence[int]) -> dict[str, int]:
    """Return the nodes by role ("left_upper_arm") of `chosen`; each node at most once.

    CMU's names → {"hips": 0, "left_upper_leg": 2, …}
    """
    found: dict[str, int] = {}
    taken: set[int] = set()
    wanted = [(role, "", stems) for role, stems in MIDDLE.items()]
    wanted += [(role, side, stems) for side in ("left", "right") for role, stems in SIDED.items()]
    by_name: dict[JointName, int] = {}
    for node in chosen:
        by_name.setdefault(names[node], node)
    for role, side, stems in wanted:
        for stem in stems:
            node = by_name.get(JointName(side, stem), -1)
            if node >= 0 and node not in taken:
                found[f"{side}_{role}" if side else role] = node
                taken.add(node)
                break
    return found
