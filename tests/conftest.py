"""Fixtures for all tests: real files of others, which lie beside the repository or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as cli.main does, and as early: before numpy

import pytest

from tests.files import ASSETS, BAD_INPUTS, SHARED


@pytest.fixture(scope="session")
def asset() -> Callable[[str], Path]:
    """The path of a file in shared/assets by its name there; skips the test where it is absent."""
    return lambda name: _found(ASSETS / name)


@pytest.fixture(scope="session")
def bad_input() -> Callable[[str], Path]:
    """The path of a file in shared/bad-inputs by its name there; skips the test where it is absent."""
    return lambda name: _found(BAD_INPUTS / name)


def _found(path: Path) -> Path:
    if not path.is_file():
        pytest.skip(f"{path.relative_to(SHARED.parent)} is not there")
    return path
