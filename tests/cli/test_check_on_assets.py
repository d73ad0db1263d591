"""`check` on real files: no false error, and fixes that leave clean, valid files which a second run does not change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.check.checked_file import CheckedFile
from anim.check.find import find_all
from anim.check.finding import Severity
from anim.check.fixing import fix_all
from anim.check.registry import RULES
from anim.check.selection import RuleSelection
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.measure.inspect.contents import read_contents
from anim.measure.inspect.inspect import inspect
from tests.cli.conftest import Call, Find
from tests.files import ASSETS, glb_of, mark_slow, opened_path
from tests.khronos import needs_validator, validate_many

QUICK = (
    "BitmojiRun.glb",
    "BoxAnimated.gltf",
    "CesiumMan.glb",
    "CubicMorph/01_cs_morph.gltf",
    "CubicRotate/01_cs_rotate.gltf",
    "Fox.glb",
    "InterpolationTest.gltf",
    "MorphStressTest.glb",
    "RiggedSimple.gltf",
    "SimpleMorph.gltf",
    "SimpleSkin.gltf",
    "vrm/Godette.vrm",
    "vrm/test.vrma",
)
LARGE = ("AnimationPointer/24_animation_pointer.gltf", "BusterDrone/busterDrone.gltf", "Knight.glb", "Robot.glb")
DEFAULT = RuleSelection()
EVERYTHING = RuleSelection(select=("ALL",), ignore=("GA109", "GA111"))  # whose fixes yield to that of GA102
NAMES = [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in LARGE)]
FIXED = ("CesiumMan.glb", "CubicMorph/01_cs_morph.gltf", "Fox.glb", "InterpolationTest.gltf", "vrm/test.vrma")


def checked(document: Document) -> CheckedFile:
    """Return a document as it is written."""
    data = np.frombuffer(glb_of(document), np.uint8)
    contents = read_contents(container.read(data), file_bytes=len(data))
    return CheckedFile(contents, inspect(contents))


@needs_validator
@pytest.mark.parametrize("name", mark_slow([*QUICK, *LARGE], slow={*QUICK, *LARGE}.difference(FIXED)))
@pytest.mark.parametrize(
    ("selection", "unsafe"),
    [
        pytest.param(DEFAULT, False, id="safe"),
        pytest.param(DEFAULT, True, id="unsafe"),
        pytest.param(EVERYTHING, True, id="everything", marks=pytest.mark.slow),
    ],
)
def test_fixed_files_are_clean_and_valid(name: str, selection: RuleSelection, unsafe: bool, asset: Find) -> None:
    file = checked(opened_path(asset(name)))
    result = fix_all(file, selection, unsafe=unsafe)
    fixed = checked(result.document)
    applied = {rule.code for rule in RULES if rule.fix is not None and (rule.fix.is_safe or unsafe)}
    assert result.refused == ()
    assert {each.code for each in find_all(fixed, selection) if each.fixable} & applied == set()
    assert fix_all(fixed, selection, unsafe=unsafe).document is fixed.document
    safe = [each.error_m for each in result.applied if each.rule.fix is not None and each.rule.fix.is_safe]
    assert sum(safe) <= 1e-6 * file.diagonal
    before, after = validate_many([glb_of(file.document), glb_of(fixed.document)])
    assert codes(after) <= codes(before)


def codes(report: dict[str, Any]) -> set[str]:
    """Return the errors in a report of the validator."""
    return {each["code"] for each in report["issues"]["messages"] if each["severity"] == 0}


@pytest.mark.slow
@needs_validator
def test_files_with_errors_are_those_that_the_validator_refuses(call: Call) -> None:
    paths = sorted(path for path in ASSETS.rglob("*") if path.suffix in (".glb", ".gltf", ".vrm", ".vrma"))
    if not paths:
        pytest.skip("the real files are not there")
    found = call("check", ASSETS, "--format", "json").json["findings"]
    wrong = {Path(each["file"]) for each in found if each["severity"] == Severity.ERROR}
    reports = validate_many([glb_of(opened_path(path)) for path in wrong])
    assert all(codes(report) for report in reports)
