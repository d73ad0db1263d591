"""Files of many nodes, joints, meshes and empty clips, through commands whose work once grew with their square."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from anim.gltf.validation import hierarchy
from anim.measure.continuous_bound import node_bounds
from anim.measure.continuous_bound.prover import Prover
from anim.model import Mesh
from anim.show.page import sticks
from tests import many
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.cli.test_many import LIMIT, work

CALLS_PER_ITEM = [  # once twice as many, with an object per node and step
    (many.chain_bare, 3000, "resample --fps 5 OUT", 70),
    (many.chain_bare, 3000, "optimize --jobs 1 OUT", 100),
    (many.chain_bare, 3000, "inspect", 80),
    (many.side_meshes, 1000, "inspect", 375),
    (many.chain_bare, 3000, "check", 85),
    (many.chain_bare, 3000, "diff IN", 170),
    (many.chain_bare, 3000, "loop OUT --blend 0.1", 100),
    *((many.side, 1500, line, 100) for line in ("resample --fps 5 OUT", "optimize --jobs 1 OUT", "diff IN")),
    (many.side, 1500, "to-euler BVH", 250),
    *((many.clips_empty, 900, line, 110) for line in ("resample --fps 5 OUT", "inspect")),
    *((many.clips_empty, 900, line, 190) for line in ("optimize --jobs 1 OUT", "diff IN")),
]
CASES = [
    (many.joints, 500, "inspect"),  # ancestors of every joint, twice: 2 GB of sets for 8000
]


@pytest.mark.parametrize(("make", "count", "command"), CASES, ids=lambda each: getattr(each, "__name__", str(each)))
def test_work_grows_with_the_count(make: many.Make, count: int, command: str, call: Call, tmp_path: Path) -> None:
    taken = []
    for number in (count, 3 * count):
        (tmp_path / f"{number}.glb").write_bytes(make(number))
        taken.append(work(call, command, tmp_path / f"{number}.glb"))
    assert taken[1] < LIMIT * taken[0]


def test_a_joint_of_a_long_spring_chain_takes_few_calls(call: Call, tmp_path: Path) -> None:
    """Not one for every joint above it."""
    (tmp_path / "in.glb").write_bytes(many.spring_line(500))
    options = ("--duration", "0.02", "--fps", "60")
    assert work(call, "simulate", "springs", tmp_path / "in.glb", tmp_path / "out.glb", *options) < 1400 * 500


def test_a_joint_of_a_deep_character_takes_few_calls(call: Call, tmp_path: Path) -> None:
    (tmp_path / "in.json").write_bytes(many.json_curves(900))
    (tmp_path / "onto.glb").write_bytes(many.chain(900))
    options = ("--onto", tmp_path / "onto.glb")
    assert work(call, "from-euler", tmp_path / "in.json", tmp_path / "out.glb", *options) < 4500 * 900


@pytest.mark.parametrize(("make", "count", "line", "limit"), CALLS_PER_ITEM, ids=lambda each: str(each).split()[0])
def test_a_node_or_clip_takes_few_calls(
    make: many.Make, count: int, line: str, limit: int, call: Call, tmp_path: Path
) -> None:
    path = tmp_path / "in.glb"
    path.write_bytes(make(count))
    names = {"OUT": tmp_path / "out.glb", "BVH": tmp_path / "out.bvh", "IN": path}
    command, *options = line.split()
    assert work(call, command, path, *(names.get(each, each) for each in options)) < limit * count


def test_a_deep_chain_of_moving_nodes_is_sampled_and_bounded_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More samples would prove nothing there; bounds take few steps, not one per level."""
    counted = {"certified": 0, "product": 0}

    def count(owner: object, name: str) -> None:
        function = getattr(owner, name)

        def called(*args: Any, **options: Any) -> Any:
            counted[name] += 1
            return function(*args, **options)

        monkeypatch.setattr(owner, name, called)

    count(Prover, "certified")
    count(node_bounds, "product")
    (tmp_path / "in.glb").write_bytes(many.chain_open(600))
    call("resample", tmp_path / "in.glb", tmp_path / "out.glb", "--fps", "5").product()
    assert counted["certified"] == 1
    assert counted["product"] < 600


@pytest.mark.parametrize("line", ["inspect", "check", "resample OUT --fps 20", "optimize OUT", "diff IN", "loop OUT"])
def test_equal_primitives_are_measured_once(
    line: str, call: Call, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = folder / "equal.glb"
    path.write_bytes(many.primitives_equal(50))
    stored: list[int] = []
    check = Mesh.__post_init__

    def checked(mesh: Mesh) -> None:
        stored.append(len(mesh.positions))
        check(mesh)

    monkeypatch.setattr(Mesh, "__post_init__", checked)
    command, *options = line.replace("OUT", "out.glb").replace("IN", str(path)).split()
    assert call(command, str(path), *options).code == 0
    assert max(stored) == 3


def test_parents_are_found_once_for_all_baked_meshes(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(many.side_meshes(100))
    counted = count_calls(monkeypatch, hierarchy, "parents")
    call("bake", tmp_path / "in.glb", tmp_path / "out.glb", "--rigid", "--fps", "2").product()
    assert 0 < len(counted) < 20


def test_sticks_of_many_trees_are_stored_at_once(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "in.glb").write_bytes(many.side(50))
    counted = count_calls(monkeypatch, sticks, "append_accessors")
    call("view", tmp_path / "in.glb", "-o", tmp_path / "out.html").product()
    assert len(counted) == 1
