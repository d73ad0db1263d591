"""Which clips, nodes and tracks a command is about."""

from __future__ import annotations

import pytest

from anim.errors import NotFoundError
from anim.gltf.reading import reader
from anim.model import Skeleton
from anim.operations.selection import Selection, match_names
from tests.clips import clip, skeleton, track
from tests.files import opened_fixture

CLIPS = ["Walk", "Run", "walk_fast", "", "Idle"]
MOVES = clip(
    track("translation", [0], [[0, 0, 0]], node=0),
    track("scale", [0], [[0, 0, 0]], node=1),
    track("weights", [0], [[0]], node=1),
    track("/materials/0/alphaCutoff", [0], [[0]]),
)


@pytest.mark.parametrize(
    ("globs", "numbers"),
    [
        ([], [0, 1, 2, 3, 4]),
        (["Run"], [1]),
        (["*"], [0, 1, 2, 3, 4]),
        (["walk*"], [2]),
        (["[Ww]alk*"], [0, 2]),
        (["Idle", "Walk"], [0, 4]),
        (["3"], [3]),
        (["#3", "#0"], [0, 3]),
        (["#5"], []),
        (["#*"], [3]),
        (["?????"], []),
    ],
)
def test_clips(globs: list[str], numbers: list[int]) -> None:
    if not numbers:
        with pytest.raises(NotFoundError, match="no clip matches"):
            Selection(clips=globs).chosen_clips(CLIPS)
    else:
        assert Selection(clips=globs).chosen_clips(CLIPS) == numbers


def test_a_name_that_is_written_exactly_comes_before_globs() -> None:
    """Without escapes no glob selected the clip 'Run[1]', and '*' in a name selected all."""
    names = ["Run[1]", "Run1", "a*", "ab"]
    assert Selection(clips=["Run[1]"]).chosen_clips(names) == [0]
    assert Selection(clips=["Run[12]"]).chosen_clips(names) == [1]
    assert Selection(clips=["a*"]).chosen_clips(names) == [2]
    assert Selection(clips=["a*", "Run?"]).chosen_clips(names) == [1, 2]


def test_an_index_comes_before_a_clip_that_is_called_like_it() -> None:
    """'#0' chose both, so that no text chose clip 0 alone."""
    names = ["a", "b", "#0"]
    assert Selection(clips=["#0"]).chosen_clips(names) == [0]
    assert Selection(clips=["#2"]).chosen_clips(names) == [2]
    assert Selection(clips=["[#]0"]).chosen_clips(names) == [2]
    assert Selection(clips=["#9"]).chosen_clips(["a", "#9"]) == [1]


def test_what_is_near_is_suggested() -> None:
    with pytest.raises(NotFoundError, match="no clip matches 'wlak'") as caught:
        Selection(clips=["wlak"]).chosen_clips(CLIPS)
    assert caught.value.help == "did you mean 'Walk'?"
    with pytest.raises(NotFoundError) as caught:
        Selection(clips=["zzz"]).chosen_clips(CLIPS)
    assert "'Walk', 'Run'" in caught.value.help
    with pytest.raises(NotFoundError) as caught:
        Selection(clips=["zzz"]).chosen_clips([])
    assert caught.value.help == "the file has no clips"


@pytest.mark.parametrize(
    ("what", "listed"), [("mesh", "the meshes are 'a'"), ("mesh or node", "the meshes or nodes are 'a'")]
)
def test_names_are_listed_after_the_plural(what: str, listed: str) -> None:
    with pytest.raises(NotFoundError) as found:
        match_names(["zzz"], ["a"], what)
    assert found.value.help == listed


def test_nodes_are_named_or_numbered() -> None:
    nodes = skeleton([-1, -1, -1])
    assert Selection(nodes=["1", "2"]).chosen_nodes(nodes) == [1, 2]
    with pytest.raises(NotFoundError, match="no node matches 'hip'"):
        Selection(nodes=["hip"]).chosen_nodes(nodes)


@pytest.mark.parametrize(
    ("nodes", "paths", "numbers"),
    [
        ([], [], {0, 1, 2, 3}),
        (["1"], [], {1, 2}),
        ([], ["weights", "translation"], {0, 2}),
        (["1"], ["scale"], {1}),
        (["0"], ["scale"], set()),
    ],
)
def test_tracks(nodes: list[str], paths: list[str], numbers: set[int]) -> None:
    two: Skeleton = skeleton([-1, -1])
    assert Selection(nodes=nodes, paths=paths).chosen_tracks(MOVES, two) == numbers


def test_a_pointer_at_a_node_is_that_nodes_track() -> None:
    document = opened_fixture("pointer")
    turn = next(each for each in reader.clips(document) if each.name == "turn")
    chosen = Selection(nodes=["turning"], paths=["rotation"]).chosen_tracks(turn, reader.skeleton(document))
    assert chosen == {0}


@pytest.mark.parametrize(
    ("glob", "names", "suggested"),
    [
        ("*FOOT", ["hips", "left_foot", "right_foot"], "'*foot'"),
        ("hand*", ["HAND_L", "HAND_R"], "'HAND*'"),
        ("hand*", ["Hand", "Hand2", "foot"], "'Hand*'"),
        ("*_FOOT", ["Left_foot", "rIGHT_fOOT"], "'Left_foot' or 'rIGHT_fOOT'"),
        ("head", ["hEAD", "heads"], "'hEAD'"),
    ],
)
def test_another_case_is_suggested_so_that_it_matches(glob: str, names: list[str], suggested: str) -> None:
    with pytest.raises(NotFoundError) as caught:
        match_names([glob], names, "node")
    assert caught.value.help == f"upper and lower case differ: did you mean {suggested}?"
    for each in suggested.replace("'", "").split(" or "):
        assert match_names([each], names, "node")
