"""Fixtures of the library."""

from __future__ import annotations

from pathlib import Path

import pytest

import fixtures


@pytest.fixture
def biped(tmp_path: Path) -> Path:
    path = tmp_path / "biped.glb"
    path.write_bytes(fixtures.build("biped"))
    return path
