"""Names that may stand once only: those that are given stay, numbers go to those that came before."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from anim.exchange.formats.labels import label_of, labels, skipped_note, unique
from tests.clips import skeleton, track


def test_a_number_never_takes_the_name_of_another() -> None:
    assert unique(["a", "a", "a.2", "b", "a"]) == ["a", "a.3", "a.2", "b", "a.4"]


@given(st.lists(st.sampled_from(["a", "a.2", "a.2.2", "a.3", "", "b"])))
def test_names_become_unique_and_the_first_of_each_stays(names: list[str]) -> None:
    found = unique(names)
    assert len(set(found)) == len(found)
    for name, new in zip(names, found, strict=True):
        assert new.startswith(name)
        assert found[names.index(name)] == name


def test_a_crowd_of_one_name_is_numbered_in_its_order() -> None:
    assert unique(["a"] * 20_000)[-1] == "a.20000"


def test_labels_are_on_one_line_and_none_is_empty() -> None:
    bones = replace(skeleton([-1, 0, 0, 0]), names=("left\n knee ", "", "left knee", "hip"))
    assert labels(bones) == ["left knee", "node 1", "left knee.2", "hip"]


def test_what_is_left_out_is_one_note() -> None:
    words = [label_of(track("scale", [0], [[1, 1, 1]], node=node), "abcde") for node in range(5)]
    words.append(label_of(track("/materials/0/alphaCutoff", [0], [[1]]), "a"))
    assert words[-1] == "/materials/0/alphaCutoff"
    assert skipped_note(words) == ("left out: scale of 'a', scale of 'b', scale of 'c' and 3 more",)
    assert skipped_note(words[:1]) == ("left out: scale of 'a'",)
    assert skipped_note([]) == ()
