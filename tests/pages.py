"""The script of pages, which needs Node.js to be built: tests of pages are skipped, with the reason, without it.

With $REQUIRE_PAGE set, its absence is an error.
"""

from __future__ import annotations

import os

import pytest

from anim.errors import UnsupportedError
from anim.show.page.resources import BUILD_COMMAND, read_script


def missing() -> str:
    """Return why there are no pages, "" if there are."""
    try:
        read_script()
    except UnsupportedError:
        return f"the page's script is not built ({BUILD_COMMAND})"
    return ""


if os.environ.get("REQUIRE_PAGE") and missing():
    raise RuntimeError(missing())

needs_page = pytest.mark.skipif(bool(missing()), reason=missing() or "present")
