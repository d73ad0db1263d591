"""The files that CONTRIBUTING names exist, and a command is understood by opening as few of them as it promises."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
MOST = {"resample": 5, "bake": 8, "optimize": 12}  # files to open
FOLDERS = ("", "anim", "anim/skinning", "anim/optimization", "anim/curves", "anim/exchange", "anim/caches")


@pytest.mark.parametrize("command", MOST)
def test_a_command_is_understood_by_few_files(command: str) -> None:
    entry = re.search(rf"- \*\*{command}\*\* \((\d+)\):(.*?)\n(?:- |\n)", TEXT, re.DOTALL)
    assert entry is not None
    files = re.findall(r"`([\w/]+\.py)`", entry[2])
    assert len(set(files)) == len(files) == int(entry[1]) <= MOST[command]
    assert not [name for name in files if not _exists(name)]


def test_named_modules_exist() -> None:
    names = set(re.findall(r"`((?:anim|cli|tests)/[\w/]+\.py)`", TEXT)) - _examples()
    assert len(names) > 10
    missing = [name for name in sorted(names) if not (ROOT / name).is_file()]
    assert not missing, "CONTRIBUTING.md names files that don't exist; files to be written are x.py"


def _examples() -> set[str]:
    """Files that a contributor is to write: x.py."""
    return {name for name in re.findall(r"`([\w/]+\.py)`", TEXT) if re.search(r"(^|/|_)x\.py$", name)}


def _exists(name: str) -> bool:
    return any((ROOT / folder / name).is_file() for folder in FOLDERS)
