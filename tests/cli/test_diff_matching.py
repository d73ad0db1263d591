"""`diff` of files whose clips or nodes have no names in common."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from anim.gltf.document import Document
from tests.cli.conftest import Call
from tests.files import glb_of, opened_fixture


def test_files_without_clips_can_be_held_against_each_other(tmp_path: Path, call: Call) -> None:
    document = opened_fixture("biped")
    bare = replace(document, json={key: value for key, value in document.json.items() if key != "animations"})
    path = saved(tmp_path / "bare.glb", bare)
    assert "no clips to compare" in call("diff", path, path).text
    run = call("diff", path, path, "--fail-above", "1m")
    assert (run.code, run.err) == (6, f"gltf-anim: {path}, {path}: no clips to compare\n")
    full = saved(tmp_path / "full.glb", document)
    assert call("diff", path, full, "--fail-above", "1m", "-q").code == 6
    found = call("diff", path, path, "--format", "json").json
    assert (found["clips"], found["max_error_m"]) == ([], 0)


def test_strangers_are_called_that_before_anything_else(tmp_path: Path, call: Call) -> None:
    """Nothing has the same name: clips and nodes are held against each other by order, which proves nothing."""
    paths = saved(tmp_path / "a.glb", opened_fixture("arm")), saved(tmp_path / "b.glb", opened_fixture("biped"))
    run = call("diff", *paths)
    problem = "no clip and no node has the same name in both files"
    assert run.code == 0
    assert run.err == f"warning: {problem}: both are compared in their order; are they two versions of one thing?\n"
    assert problem not in run.text, "twice in a terminal"
    assert call("diff", *paths, "-q").err == run.err
    found = call("diff", *paths, "--format", "json").json
    assert (found["clips_matched_by_name"], found["nodes_matched_by_name"]) == (0, 0)
    assert call("diff", *paths, "--fail-above", "1%").code == 6


BY_ORDER = "has the same name in both files: {} are compared in their order"


@pytest.mark.parametrize(
    ("clips", "nodes", "words"),
    [
        (True, False, f"no node {BY_ORDER.format('nodes')}"),
        (False, True, f"no clip {BY_ORDER.format('clips')}"),
        (True, True, ""),
    ],
)
def test_what_has_no_name_in_common_is_named(clips: bool, nodes: bool, words: str, tmp_path: Path, call: Call) -> None:
    """Only files without any common name had a warning: "walk" is a name that strangers share."""
    document = opened_fixture("biped")
    names = {"animations": clips, "nodes": nodes}
    other = {
        key: [{**each, "name": each["name"] if kept else f"{each['name']} 2"} for each in document.json[key]]
        for key, kept in names.items()
    }
    renamed = replace(document, json={**document.json, **other})
    run = call("diff", saved(tmp_path / "a.glb", document), saved(tmp_path / "b.glb", renamed), "--format", "json")
    assert run.err == (f"warning: {words}\n" if words else "")
    found = run.json
    assert found["warnings"] == [words] * bool(words)
    assert found["clips_matched_by_name"] == 3 * clips
    assert found["nodes_matched_by_name"] == len(document.json["nodes"]) * nodes
    assert found["max_error_m"] == 0  # by order they are the same all the same


def test_single_clips_with_two_names_need_no_warning(tmp_path: Path, call: Call) -> None:
    """No other match is possible, and the table has both names."""
    document = opened_fixture("biped")
    paths = [
        saved(
            tmp_path / f"{name}.glb",
            replace(document, json={**document.json, "animations": [{**document.json["animations"][0], "name": name}]}),
        )
        for name in ("a", "b")
    ]
    run = call("diff", *paths)
    assert run.err == ""
    assert "\na → b " in run.text


def test_nodes_whose_names_share_their_letters_are_matched_by_name(tmp_path: Path, call: Call) -> None:
    document = opened_fixture("biped")
    dotted = [{**each, "name": each["name"].replace("_", ".") + "."} for each in document.json["nodes"]]
    other = saved(tmp_path / "b.glb", replace(document, json={**document.json, "nodes": dotted}))
    run = call("diff", saved(tmp_path / "a.glb", document), other, "--format", "json")
    assert run.err == ""
    assert run.json["nodes_matched_by_name"] == len(dotted)


def test_files_without_names_are_compared_in_their_order(tmp_path: Path, call: Call) -> None:
    document = opened_fixture("biped")
    bare = {key: [{**each, "name": ""} for each in document.json[key]] for key in ("animations", "nodes")}
    nameless = saved(tmp_path / "b.glb", replace(document, json={**document.json, **bare}))
    run = call("diff", saved(tmp_path / "a.glb", document), nameless)
    assert "\nwave → #1 " in run.text
    assert run.err == f"warning: no clip and no node {BY_ORDER.format('both')}\n"
    run = call("diff", nameless, nameless)
    assert run.err == "", "nothing contradicts the order"
    assert "3 clips compared, max 0 mm" in run.text


def saved(path: Path, document: Document) -> Path:
    path.write_bytes(glb_of(document))
    return path


@pytest.mark.parametrize(("lost", "said"), [(0, True), (1, True), (None, False)])
def test_clips_of_one_name_are_said_to_be_matched_in_order(
    lost: int | None, said: bool, tmp_path: Path, call: Call
) -> None:
    document = opened_fixture("arm")
    clips = [{**each, "name": "c0"} for each in document.json["animations"]]
    left = [each for i, each in enumerate(clips) if i != lost]
    one, other = (
        saved(tmp_path / f"{name}.glb", replace(document, json={**document.json, "animations": animations}))
        for name, animations in (("a", clips), ("b", left))
    )
    run = call("diff", one, other, "--format", "json", "-q")
    assert bool(run.json["warnings"]) is said
    assert ("2 clips named 'c0'" in run.err) is said
