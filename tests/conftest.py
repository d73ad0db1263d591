"""Fixtures for all tests: real files of others, which lie beside the repository or not at all.

The gate tries the same random examples each time and has no deadlines: a loaded machine changes nothing. Others are
tried by `make fuzz`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as cli.main does, and as early: before numpy

import pytest
from hypothesis import HealthCheck, settings

from tests.files import ASSETS, BAD_INPUTS, SHARED

settings.register_profile("gate", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("random", settings.get_profile("gate"), derandomize=False)
settings.load_profile("gate")


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
