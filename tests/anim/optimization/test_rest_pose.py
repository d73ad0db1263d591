"""The rest pose moved to where clips hold it: only what every clip drives, and nothing is seen to move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.measure.error.metric import ErrorMetric
from anim.optimization.rest_pose import RebasedDocument, rebase
from tests.anim.optimization.making import TIMES, scene, turning
from tests.clips import about, clip, track

OF = scene()
DOCUMENT = Document({"asset": {"version": "2.0"}, "nodes": [{"name": str(i)} for i in range(6)]}, ())
BENT = about("x", 30).astype(np.float32).astype(np.float64)
CONSTANT = track("rotation", [0, 1], np.tile(BENT, (2, 1)), node=1)
MOVING = track("rotation", TIMES, turning(1.0), node=1)
OTHER = track("scale", TIMES, np.ones((25, 3)), node=2)


def _rebased(*clips: tuple[object, ...], document: Document = DOCUMENT) -> RebasedDocument:
    return rebase(document, OF, [clip(*tracks) for tracks in clips])  # type: ignore[arg-type]


def test_what_every_clip_drives_goes_to_the_commonest_constant() -> None:
    found = _rebased((CONSTANT,), (MOVING,), (CONSTANT, OTHER))
    assert found.moved == ((1, "rotation"),)
    assert found.scene.skeleton.rotation[1] == pytest.approx(BENT, abs=1e-6)
    assert np.array(found.document.json["nodes"][1]["rotation"], np.float32).tolist() == BENT.tolist()


def test_what_one_clip_leaves_alone_stays() -> None:
    found = _rebased((CONSTANT,), (CONSTANT,), (OTHER,))
    assert found.moved == ()
    assert found.document is DOCUMENT
    assert found.scene is OF


@pytest.mark.parametrize("name", ["VRM", "VRMC_vrm", "VRMC_springBone", "VRMC_node_constraint"])
def test_a_rest_pose_that_extensions_use_stays(name: str) -> None:
    document = Document({**DOCUMENT.json, "extensionsUsed": [name]}, ())
    assert _rebased((CONSTANT,), (MOVING,), (CONSTANT, OTHER), document=document).moved == ()


def test_nothing_moves_in_any_clip() -> None:
    clips = [clip(CONSTANT, OTHER), clip(MOVING), clip(CONSTANT)]
    found = rebase(DOCUMENT, OF, clips)
    ruler = ErrorMetric(OF, found.scene)
    assert found.moved
    for each in clips:
        assert ruler.error(each, each).max_error < 1e-7


def test_constants_of_most_clips_win() -> None:
    other = replace(CONSTANT, values=np.tile(about("z", 50), (2, 1)))
    found = _rebased((other,), (CONSTANT,), (replace(CONSTANT, values=-CONSTANT.values),))
    turn = found.scene.skeleton.rotation[1]
    assert abs(turn @ BENT) == pytest.approx(1)


def test_all_other_properties_and_nodes_stay_as_they_were() -> None:
    before = OF.skeleton
    found = _rebased((CONSTANT,), (CONSTANT,))
    for path in ("translation", "scale"):
        assert (getattr(found.scene.skeleton, path) == getattr(before, path)).all()
    others = np.arange(6) != 1
    assert (found.scene.skeleton.rotation[others] == before.rotation[others]).all()
    nodes = found.document.json["nodes"]
    assert [list(node) for node in nodes] == [["name"], ["name", "rotation"], *[["name"]] * 4]
    assert all("rotation" not in node for node in DOCUMENT.json["nodes"])


def test_rest_that_is_already_there_stays() -> None:
    rest = track("rotation", [0, 1], np.tile(-OF.skeleton.rotation[1], (2, 1)), node=1)
    assert _rebased((rest,), (rest,)).moved == ()


def test_a_node_with_a_matrix_stays() -> None:
    nodes = [{**node, "matrix": np.eye(4).ravel().tolist()} for node in DOCUMENT.json["nodes"]]
    document = replace(DOCUMENT, json={**DOCUMENT.json, "nodes": nodes})
    assert _rebased((CONSTANT,), document=document).moved == ()


def test_no_clips() -> None:
    assert rebase(DOCUMENT, OF, []).moved == ()


@pytest.mark.parametrize("exact", [False, True])
def test_the_scene_is_what_the_document_says(exact: bool) -> None:
    """Players read decimals as float64 or float32: both get the constant, the former to the last digit if exact."""
    found = rebase(DOCUMENT, OF, [clip(CONSTANT)], exact=exact)
    written = np.array(found.document.json["nodes"][1]["rotation"])
    assert found.scene.skeleton.rotation[1] == pytest.approx(written, abs=1e-16)
    assert (written.astype(np.float32) == BENT).all()
    assert (written == BENT).all() or not exact
    assert exact or len(str(written.tolist())) < len(str(BENT.tolist()))
