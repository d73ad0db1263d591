"""Rules: each finds a file that breaks it, and none of them finds the sound file it was made from."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from anim.check.checked_file import CheckedFile
from anim.check.find import find_all, find_grouped
from anim.check.finding import Finding, Occurrence
from anim.check.fixing import fix_all
from anim.check.registry import RULES
from anim.check.rules import loop_seam, residual_root_motion
from anim.check.selection import RuleSelection
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.measure.inspect.contents import read_contents
from anim.measure.inspect.inspect import inspect
from anim.model import Clip, Track
from tests.clips import CUBICSPLINE, STEP, clip, track
from tests.files import glb_of, opened, opened_fixture

Edit = Callable[[dict[str, Any]], None]
SECOND = np.linspace(0, 1, 13)
SMOOTH = np.sin(SECOND * 2 * np.pi)[:, None] * [0.1, 0.0, 0.0]

WAVE_12 = track("translation", SECOND, SMOOTH, node=1)
OPEN_WAVE = track("translation", SECOND[:-1], SMOOTH[:-1], node=1)
WAVE_120 = track("translation", SECOND / 10, SMOOTH, node=1)


def checked(document: Document) -> CheckedFile:
    data = glb_of(document)
    contents = read_contents(opened(data), file_bytes=len(data))
    return CheckedFile(contents, inspect(contents))


def found(document: Document, code: str, **parameters: str) -> list[Finding]:
    values = {f"{code}.{name}": value for name, value in parameters.items()}
    return [*find_all(checked(document), RuleSelection(select=(code,), parameters=values))]


def edited(edit: Edit, name: str = "arm") -> Document:
    """Return a fixture with an edited JSON."""
    document = opened_fixture(name)
    json = copy.deepcopy(document.json)
    edit(json)
    return Document(json, document.buffers)


def with_tracks(*tracks: Track, name: str = "walk", fixture: str = "arm") -> Document:
    """Return a fixture with other tracks in its first clip."""
    document = opened_fixture(fixture)
    return writer.replace_clips(document, {0: Clip(name, tracks)})


def put(path: str, value: Any) -> Edit:
    """Return an edit that sets a property by its JSON pointer; None removes it."""

    def edit(json: dict[str, Any]) -> None:
        *parts, last = path.strip("/").split("/")
        at: Any = json
        for part in parts:
            at = at[int(part)] if isinstance(at, list) else at.setdefault(part, {})
        if value is None:
            del at[last]
        else:
            at[int(last) if isinstance(at, list) else last] = value

    return edit


def steps(values: Sequence[float]) -> Track:
    return track("translation", np.arange(len(values)) / 10, [[value, 0, 0] for value in values], node=1)


def joint(path: str, values: list[list[float]], times: list[float] | None = None) -> Track:
    return track(path, np.array(times or [0.0, 1.0]), values, node=opened_fixture("arm").json["skins"][0]["joints"][1])


def with_weights(values: list[list[float]]) -> Document:
    return with_tracks(track("weights", np.array([0.0, 1.0]), values, node=0), fixture="morph_cube")


def spline(slope: float) -> Track:
    tangents = [[slope, 0, 0], [-slope, 0, 0]]
    return track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]], CUBICSPLINE, node=1, tangents=(tangents, tangents))


def other_root(json: dict[str, Any]) -> None:
    """Animate a node that is in no scene."""
    json["nodes"].append({"name": "lost"})
    for channel in json["animations"][0]["channels"]:
        channel["target"] = {"node": len(json["nodes"]) - 1, "path": channel["target"]["path"]}
    json["animations"][0]["channels"] = json["animations"][0]["channels"][:1]


def same_names(json: dict[str, Any]) -> None:
    for node in json["nodes"]:
        node["name"] = "bone"


def scale_above(json: dict[str, Any]) -> None:
    joints = json["skins"][0]["joints"]
    json["nodes"].append({"name": "Armature", "scale": [0.01, 0.01, 0.01], "children": [joints[0]]})
    for scene in json["scenes"]:
        scene["nodes"] = [len(json["nodes"]) - 1 if node == joints[0] else node for node in scene["nodes"]]


def second_skin(json: dict[str, Any]) -> None:
    json["skins"].append(json["skins"][0])


def move_mesh(json: dict[str, Any]) -> None:
    next(node for node in json["nodes"] if "skin" in node)["translation"] = [0.0, 1.0, 0.0]


def pointer_at_node(json: dict[str, Any]) -> None:
    channel = json["animations"][0]["channels"][0]
    address = f"/nodes/{channel['target']['node']}/{channel['target']['path']}"
    channel["target"] = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": address}}}


def declared_pointer(json: dict[str, Any]) -> None:
    pointer_at_node(json)
    json["extensionsUsed"] = ["KHR_animation_pointer"]


WRONG: dict[str, tuple[Document, str]] = {
    "GA001": (edited(put("animations/0/name", "")), "/animations/0"),
    "GA003": (edited(same_names, "biped"), "/nodes/"),
    "GA004": (edited(put("nodes/1/name", "arm.l")), "/nodes/1"),
    "GA005": (edited(other_root), "/animations/0"),
    "GA007": (edited(put("meshes/0/extras", None), "morph_cube"), "/meshes/0"),
    "GA106": (with_tracks(joint("translation", [[0, 0, 0]], [0])), "/animations/0"),
    "GA107": (with_tracks(steps([0, 1, 2, 1, 0.02])), "/animations/0"),
    "GA108": (with_tracks(OPEN_WAVE), "/animations/0"),
    "GA110": (with_tracks(WAVE_120), "/animations/0"),
    "GA114": (with_tracks(steps([0] * 5 + [1] * 5 + [0] * 5)), "/animations/0"),
    "GA115": (with_tracks(spline(8.0)), "/animations/0"),
    "GA116": (with_tracks(joint("scale", [[1, 1, 1], [0, 1, 1]])), "/animations/0"),
    "GA117": (with_tracks(joint("scale", [[1, 1, 1], [-1, 1, 1]])), "/animations/0"),
    "GA118": (
        with_weights([[0, 1.5, 0], [1, 0, 0]]),
        "/animations/0",
    ),
    "GA203": (opened_fixture("arm"), "/skins/0"),
    "GA204": (edited(second_skin), "/nodes/"),
    "GA205": (edited(put("skins/0/inverseBindMatrices", None)), "/skins/0"),
    "GA207": (edited(move_mesh), "/nodes/"),
    "GA208": (edited(scale_above), "/skins/0"),
    "GA209": (with_tracks(steps([0, 100])), "/animations/0"),
    "GA210": (with_tracks(joint("scale", [[1, 1, 1], [1, 2, 1]])), "/nodes/"),
    "GA211": (with_tracks(joint("scale", [[1, 1, 1], [2, 2, 2]])), "/animations/0"),
    "GA401": (opened_fixture("arm"), "/animations"),
    "GA501": (edited(pointer_at_node), "/extensionsUsed"),
    "GA502": (edited(declared_pointer), "/animations/0"),
}
SOUND: dict[str, Document] = {
    "GA007": opened_fixture("morph_cube"),
    "GA107": with_tracks(steps([0, 1, 2, 1, 0])),
    "GA108": with_tracks(WAVE_12),
    "GA110": with_tracks(WAVE_12),
    "GA114": with_tracks(WAVE_12),
    "GA115": with_tracks(spline(0.1)),
    "GA116": with_tracks(joint("scale", [[1, 1, 1], [0.5, 1, 1]])),
    "GA117": with_tracks(joint("scale", [[1, 1, 1], [0.5, 1, 1]])),
    "GA118": with_weights([[0, 1, 0], [1, 0, 0]]),
    "GA210": with_tracks(joint("scale", [[1, 1, 1], [2, 2, 2]])),
    "GA211": with_tracks(joint("scale", [[1, 1, 1], [1, 1, 1]])),
}
PARAMETERS = {"GA203": {"joints": "1"}, "GA401": {"bytes": "0", "fraction": "0"}}


@pytest.mark.parametrize("code", WRONG)
def test_a_rule_finds_what_breaks_it(code: str) -> None:
    document, pointer = WRONG[code]
    findings = found(document, code, **PARAMETERS.get(code, {}))
    assert findings
    assert all(each.pointer.startswith(pointer) and each.problem and each.advice for each in findings)


@pytest.mark.parametrize("code", WRONG)
def test_a_rule_is_silent_on_a_sound_file(code: str) -> None:
    assert found(SOUND.get(code, opened_fixture("arm")), code) == []


def test_a_node_hidden_by_step_is_no_zero_scale() -> None:
    hidden = track("scale", np.array([0.0, 1.0]), [[1, 1, 1], [0, 0, 0]], STEP, node=1)
    assert found(with_tracks(hidden), "GA116") == []


def test_steps_that_are_not_isolated_are_no_lost_step() -> None:
    assert found(with_tracks(steps([0] * 5 + [1, 2, 3] + [3] * 6)), "GA114") == []


def test_a_clip_that_loops_by_name_may_not_jump_further() -> None:
    values = [0.0, 1.0, 2.0, 3.0]
    assert found(with_tracks(steps(values), name="jump"), "GA107") == []
    assert found(with_tracks(steps(values), name="run_loop"), "GA107")


def test_a_channel_that_lost_its_pointer_uses_no_extension() -> None:
    """Tools that skip the extension write it: declared, the file would name an extension that nothing uses."""
    lost = edited(put("animations/0/channels/0/target", {"path": "pointer"}))
    assert found(lost, "GA501") == []
    assert found(lost, "GA015")


def test_eight_active_targets_are_promised() -> None:
    def names(count: int) -> list[Finding]:
        document = opened_fixture("morph_cube")
        targets = reader.clips(document)[0].tracks[0].values.shape[1]
        values = np.zeros((2, targets))
        values[1, : min(count, targets)] = 1
        changed = writer.replace_clips(document, {0: clip(track("weights", [0, 1], values, STEP), name="face")})
        return found(changed, "GA119", targets="0" if count else "8")

    assert names(1)[0].problem == "up to 1 morph targets of a mesh are active at once"
    assert names(0) == []


def test_costly_rules_are_left_to_check() -> None:
    file = checked(WRONG["GA209"][0])
    selection = RuleSelection(select=("GA209",))
    assert find_all(file, selection)
    assert find_grouped(file, selection) == ()


def test_clips_are_summed_up_where_a_rule_can() -> None:
    file = checked(opened_fixture("noop"))
    selection = RuleSelection(select=("GA111",))
    grouped, single = find_grouped(file, selection), find_all(file, selection)
    assert len(grouped) == 1
    assert len(single) > 1
    assert grouped[0].where.startswith("clips '")


@pytest.mark.parametrize("code", [rule.code for rule in RULES if rule.fix and rule.code in WRONG])
def test_a_fixed_file_is_clean_and_moves_no_vertex(code: str) -> None:
    selection = RuleSelection(select=(code,))
    result = fix_all(checked(WRONG[code][0]), selection, unsafe=True)
    assert [each.rule.code for each in result.applied] == [code]
    assert result.applied[0].error_m < 1e-9
    fixed = checked(result.document)
    assert find_all(fixed, selection) == ()
    assert fix_all(fixed, selection, unsafe=True).document is fixed.document


def test_gaps_of_the_size_of_the_model_have_no_exponent() -> None:
    found = [Occurrence("clip 'walk'", "/animations/0", value=1.02)]
    assert loop_seam.problem(found) == "a loop jumps by 100 % of the model's size"
    assert residual_root_motion.problem(found).startswith("the root moves by 100 % ")
