"""Chains of spring bones by globs of names."""

from __future__ import annotations

import pytest

from anim.errors import NotFoundError
from anim.model import Skeleton
from anim.simulation.spring_bones.chain_globs import find_chains
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.simulate import SpringOptions, simulate_springs
from tests.anim.simulation.spring_bones.swaying import SOFT, swaying
from tests.clips import skeleton


def rig() -> Skeleton:
    """Body, a tail of three with an attachment, two ears; the names of a usual rig."""
    names = ("Body", "Tail1", "Tail2", "Tail3", "Bow", "Ear.L", "Ear.R")
    places = [[0, 0, 0], [0, 0, -1], [0, 0, -1], [0, 0, -1], [0, 0.1, 0], [1, 1, 0], [-1, 1, 0]]
    plain = skeleton([-1, 0, 1, 2, 2, 0, 0], translation=places)
    return Skeleton(names, plain.parents, plain.translation, plain.rotation, plain.scale)


def test_a_chain_begins_at_the_topmost_match() -> None:
    chains = find_chains(rig(), ["Tail*"], SOFT, skin_joints={0, 1, 2, 3, 5, 6})
    assert [(chain.name, [j.node for j in chain.joints]) for chain in chains] == [("Tail1", [1, 2, 3])]
    assert [joint.tail for joint in chains[0].joints] == [2, 3, None]
    assert chains[0].joints[2].tail_offset == (0, 0, -1)


def test_without_skins_every_node_below_is_a_joint() -> None:
    (chain,) = find_chains(rig(), ["Tail1"], SOFT)
    assert [joint.node for joint in chain.joints] == [1, 2, 3, 4]


def test_every_match_is_a_chain_of_its_own() -> None:
    chains = find_chains(rig(), ["Ear.*"], SOFT)
    assert [[joint.node for joint in chain.joints] for chain in chains] == [[5], [6]]


def test_a_glob_without_match_is_refused_with_similar_names() -> None:
    with pytest.raises(NotFoundError, match=r"no node matches 'Tial\*'") as caught:
        find_chains(rig(), ["Tial*"], SOFT)
    assert "Tail" in caught.value.help
    with pytest.raises(NotFoundError, match="no chain begins at node 0 '0': it has no length"):
        find_chains(skeleton([-1]), ["0"], SOFT)


def test_fifty_chains_of_ten_joints() -> None:
    count = 50 * 11
    parents = [-1] + [0 if k % 11 == 0 else k for k in range(count)]
    places = [[0, 0, 0]] + [[k, 0, 0] if k % 11 == 0 else [0, -0.1, 0] for k in range(count)]
    chains = find_chains(skeleton(parents, translation=places), [str(1 + 11 * k) for k in range(50)], SOFT)
    result = simulate_springs(
        skeleton(parents, translation=places), swaying(), SpringBones(chains), SpringOptions(duration=1)
    )
    assert len(result.joints) == count
