"""Rules: each finds a file that breaks it, and none of them finds the sound file it was made from."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.check.checked_file import CheckedFile
from anim.check.find import find_all, group_occurrences
from anim.check.finding import Finding, Occurrence
from anim.check.fixing import fix_all
from anim.check.registry import RULES
from anim.check.rules import loop_seam, residual_root_motion
from anim.check.selection import RuleSelection
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from tests.anim.check.cases import SMOOTH, SOUND, WRONG, checked, edited, found, joint, selection, steps, with_tracks
from tests.anim.check.json_faults import ARM_JOINTS, put, same_names
from tests.clips import CUBICSPLINE, LINEAR, STEP, clip, track
from tests.files import glb_of, opened_fixture

CODES = [rule.code for rule in RULES]
FIXES = {rule.code: rule.fix for rule in RULES if rule.fix}
ALWAYS_FOUND = {"GA203": {"joints": "256"}, "GA401": {}, "GA119": {}}  # files without it, by the default parameters


def broken(code: str) -> CheckedFile:
    """Return a file that breaks a rule."""
    file = WRONG[code][0]
    return file if isinstance(file, CheckedFile) else checked(file)


@pytest.mark.parametrize("code", CODES)
def test_a_rule_finds_what_breaks_it(code: str) -> None:
    """A rule without a file in WRONG fails here: every rule needs one."""
    findings = find_all(broken(code), selection(code))
    assert findings
    assert all(each.pointer.startswith(WRONG[code][1]) and each.problem and each.advice for each in findings)


@pytest.mark.parametrize("code", CODES)
def test_one_of_a_kind_is_in_the_singular(code: str) -> None:
    for each in find_all(broken(code), selection(code)):
        assert not re.search(r"(^|[^.\d])\b1 [a-z]{2,}s\b", each.problem), each.problem


@pytest.mark.parametrize("code", CODES)
def test_a_rule_is_silent_on_a_sound_file(code: str) -> None:
    chosen = RuleSelection(select=(code,)) if code in ALWAYS_FOUND else selection(code)
    assert find_all(checked(SOUND.get(code, opened_fixture("arm"))), chosen) == ()


@pytest.mark.parametrize("code", FIXES)
def test_a_fixed_file_is_clean_and_a_second_run_changes_nothing(code: str) -> None:
    file, chosen = broken(code), selection(code)
    result = fix_all(file, chosen, unsafe=not FIXES[code].is_safe)
    assert [each.rule.code for each in result.applied] == [code]
    assert result.refused == ()
    if FIXES[code].is_safe:
        assert result.applied[0].error_m <= 1e-6 * file.diagonal
    written = glb_of(result.document)
    fixed = checked(result.document)
    assert find_all(fixed, chosen) == ()
    again = fix_all(fixed, chosen, unsafe=True)
    assert again.document is fixed.document
    assert glb_of(again.document) == written


@pytest.mark.parametrize("code", [code for code, fix in FIXES.items() if not fix.is_safe])
def test_unsafe_fixes_are_not_applied_without_their_option(code: str) -> None:
    assert fix_all(broken(code), selection(code), unsafe=False).applied == ()


@pytest.mark.parametrize("code", ["GA109", "GA111"])
def test_a_fix_is_left_out_where_another_one_would_be_undone(code: str) -> None:
    chosen = RuleSelection(select=(code, "GA102"))
    (refused,) = fix_all(broken(code), chosen, unsafe=True).refused
    assert (refused.rule.code, refused.problem) == (code, "that would undo the fix of GA102")


def test_a_node_hidden_by_step_is_no_zero_scale() -> None:
    hidden = track("scale", np.array([0.0, 1.0]), [[1, 1, 1], [0, 0, 0]], STEP, node=1)
    assert found(with_tracks(hidden), "GA116") == []


def test_steps_that_are_not_isolated_are_no_lost_step() -> None:
    assert found(with_tracks(steps([0] * 5 + [1, 2, 3] + [3] * 6)), "GA114") == []


def test_a_clip_that_loops_by_name_may_not_jump_further() -> None:
    values = [0.0, 1.0, 2.0, 3.0]
    assert found(with_tracks(steps(values), name="jump"), "GA107") == []
    assert found(with_tracks(steps(values), name="run_loop"), "GA107")


@pytest.mark.parametrize(
    "times",
    [
        pytest.param(np.array([0.0, 0.5, 1.0, 1.5, 2.0]), id="sparse"),
        pytest.param(np.arange(31) / 24, id="24 fps"),
        pytest.param(np.array([0.0, 0.5, 1.0, 1.5, 2.0]) / 1.19, id="no usual rate"),
        pytest.param(np.array([0.0, 0.73]), id="two keys"),
        pytest.param(np.append(np.arange(31) / 24, 31.4 / 24), id="ends between frames"),
    ],
)
@pytest.mark.parametrize("tangents", [None, 0.0])
def test_closing_a_loop_leaves_its_keys_on_frames(times: Floats, tangents: float | None) -> None:
    """Otherwise GA109 would resample the clip because of the fix of GA107."""
    values = np.linspace([0.0, 0.0, 0.0], [0.02, 0.0, 0.0], len(times))
    sides = None if tangents is None else (values * tangents, values * tangents)
    curve = track("translation", times, values, LINEAR if sides is None else CUBICSPLINE, node=1, tangents=sides)
    both = RuleSelection(select=("GA107", "GA109"))
    file = with_tracks(curve)
    assert found(file, "GA109") == []
    result = fix_all(checked(file), both, unsafe=True)
    assert [each.rule.code for each in result.applied] == ["GA107"]
    assert find_all(checked(result.document), both) == ()


def test_a_channel_that_lost_its_pointer_uses_no_extension() -> None:
    """Tools that skip the extension write it: declared, the file would name an extension that nothing uses."""
    lost = edited(put("animations/0/channels/0/target", {"path": "pointer"}))
    assert found(lost, "GA501") == []
    assert found(lost, "GA015")


def test_a_doubled_end_frame_is_removed() -> None:
    """Two frames at the end have the first pose: a loop pauses for one."""
    times = np.arange(14) / 12
    doubled = with_tracks(track("translation", times, np.vstack((SMOOTH, SMOOTH[-1:])), node=1))
    (finding,) = found(doubled, "GA108")
    assert finding.advice == "to remove the frame: gltf-anim trim IN OUT --to 1 --clip '#0'"
    result = fix_all(checked(doubled), selection("GA108"), unsafe=True)
    assert reader.clips(result.document)[0].end == 1.0
    assert found(result.document, "GA108") == []


def with_twin(json: dict[str, Any]) -> None:
    """Add a copy of the first joint, with a child of the name of the second one, beside it."""
    first, second = (json["nodes"][each]["name"] for each in ARM_JOINTS[:2])
    count = len(json["nodes"])
    json["nodes"] += [{"name": first, "children": [count + 1]}, {"name": second}]
    json["scenes"][0]["nodes"].append(count)


def found_in_unity(document: Document, code: str) -> list[Finding]:
    return [*find_all(checked(document), RuleSelection(select=(code,), target="unity"))]


def test_unity_needs_keys_at_0_in_every_track() -> None:
    """Other players show the first value of a track until its first key; Unity poses of another clip."""
    late = joint("translation", [[0, 1, 0], [0, 2, 0]], [0.5, 1])
    document = with_tracks(track("translation", [0, 1], [[0, 0, 0], [0, 1, 0]], node=ARM_JOINTS[0]), late)
    assert found(document, "GA105") == []
    (finding,) = found_in_unity(document, "GA105")
    assert finding.problem == "1 track has its first key at 0.5 s: Unity shows another pose until then"
    assert finding.time_s == 0.5
    (finding,) = found(with_tracks(late), "GA105")
    assert (finding.problem, finding.time_s) == ("first key at 0.5 s: players hold the first pose until then", 0.5)
    fixed = fix_all(checked(document), RuleSelection(select=("GA105",), target="unity"), unsafe=False)
    assert [each.error_m for each in fixed.applied] == [0.0]
    assert found_in_unity(fixed.document, "GA105") == []


def test_a_late_clip_that_loops_keeps_its_start() -> None:
    """With a key at 0 s the pause before the first key would be part of the loop, and no end frame would close it."""
    late = np.arange(1, 14) / 12
    for end in (13, 12):  # closed; open by one frame
        looped = with_tracks(track("translation", late[:end], SMOOTH[:end], node=1))
        (finding,) = found(looped, "GA105")
        assert finding.advice.endswith("gltf-anim trim IN OUT --rebase")
        assert finding.fixable == ""
        assert found(looped, "GA108") == [] or end == 12
        result = fix_all(checked(looped), RuleSelection(select=("GA105", "GA107", "GA108")), unsafe=True)
        assert [each.rule.code for each in result.applied] == (["GA108"] if end == 12 else [])
        fixed = reader.clips(result.document)[0]
        assert (fixed.start, fixed.end) == pytest.approx((1 / 12, 13 / 12))


def test_unity_finds_nodes_by_their_path() -> None:
    moves = [[0, 0, 0], [0, 1, 0]]
    chain = with_tracks(*(track("translation", [0, 1], moves, node=node) for node in ARM_JOINTS[:2]))
    same_names(chain.json)
    chain.json["nodes"][-1]["name"] = "mesh"  # the other two are on different paths
    assert found(chain, "GA003")
    assert found_in_unity(chain, "GA003") == []
    twins = edited(with_twin)
    assert found(twins, "GA003") == []
    (finding,) = found_in_unity(twins, "GA003")
    assert finding.problem.startswith("2 nodes have the path '")
    fixed = fix_all(checked(twins), RuleSelection(select=("GA003",), target="unity"), unsafe=True)
    assert found_in_unity(fixed.document, "GA003") == []
    names = [[node.get("name") for node in each.json["nodes"]] for each in (twins, fixed.document)]
    assert sum(old != new for old, new in zip(*names, strict=True)) == 1


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
    file = broken("GA209")
    assert find_all(file, selection("GA209"))
    assert group_occurrences(file, selection("GA209")) == []


def test_clips_are_summed_up_where_a_rule_can() -> None:
    file = checked(opened_fixture("noop"))
    grouped, single = group_occurrences(file, selection("GA111")), find_all(file, selection("GA111"))
    assert len(grouped) == 1
    assert len(single) > 1
    assert grouped[0][0].where.startswith("clips '")


def test_gaps_of_the_size_of_the_model_have_no_exponent() -> None:
    occurrences = [Occurrence("clip 'walk'", "/animations/0", value=1.02)]
    assert loop_seam.problem(occurrences) == "a loop jumps by 100 % of the model's size"
    assert residual_root_motion.problem(occurrences).startswith("the root moves by 100 % ")


def test_an_empty_clip_is_an_empty_array_and_has_no_tracks_without_effect() -> None:
    """The validator reports it too (EMPTY_ENTITY); "-1 tracks equal the rest pose" would be nonsense."""
    document = edited(put("animations/0", {"name": "none", "channels": [], "samplers": []}))
    findings = find_all(checked(document))
    (empty,) = [each for each in findings if each.code == "GA011"]
    assert (empty.where, empty.pointer) == ("clip 'none'", "/animations/0")
    assert empty.problem == "1 clip with an empty array of channels or samplers"
    assert "GA113" not in {each.code for each in findings}


def test_tracks_at_rest_are_counted_as_by_inspect() -> None:
    """Of a clip with no other tracks one was left out, since it is kept."""
    alone = with_tracks(joint("scale", [[1, 1, 1], [1, 1, 1]]))
    assert found(alone, "GA113") == []
    (finding,) = found(opened_fixture("noop"), "GA113")
    counts = [clip.no_effect_tracks for clip in checked(opened_fixture("noop")).facts.clips]
    assert finding.problem == f"{sum(counts)} tracks equal the rest pose"


def test_a_clip_of_ignored_channels_is_not_empty() -> None:
    channel = {"sampler": 0, "target": {"path": "rotation"}}
    findings = find_all(checked(edited(put("animations/0/channels", [channel]))))
    assert not {"GA011", "GA113"} & {each.code for each in findings}


def test_a_late_pose_is_no_loop() -> None:
    """Nothing moves: a key at 0 s changes nothing, and is what the rule asks for."""
    held = joint("translation", [[0, 1, 0], [0, 1, 0]], [1, 2])
    (finding,) = found(with_tracks(held), "GA105")
    assert "trim IN OUT --rebase" in finding.advice
    assert "loops" not in finding.advice
    assert finding.fixable == "safe"
