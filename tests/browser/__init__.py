"""Pages in a real browser: Chromium, driven by the npm package `playwright-core`.

The package is looked for in the folders $GLTF_PLAYWRIGHT_DIR, $GLTF_THREE_DIR and $GLTF_VALIDATOR_DIR and in
`node_modules` beside pyproject.toml; Chromium on the path, or as $CHROMIUM. Tests that need both carry `@needs_browser`
and are skipped, with the reason, where one is absent; with $REQUIRE_BROWSER set, absence is an error.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests import pages

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tests" / "browser" / "visit.mjs"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
TIMEOUT_S = 600  # for one call


@dataclass(frozen=True, slots=True)
class Visit:
    """A page as the browser found it.

    ready: s. words: console messages and requests. faults: checks that failed. worst: errors in m, of two files at the
    times that the page lists as the worst ones: {"clip", "time", "error"}.
    """

    name: str
    ready: float | None
    words: list[str]
    faults: list[str]
    worst: list[dict[str, Any]]


def visit(files: Sequence[Path]) -> list[Visit]:
    """Open pages one after the other, on a desktop and on a phone; try keys, scrubber and touch.

    $PAGE_SHOTS names a folder that keeps a picture of each.
    """
    if reason := missing():
        raise RuntimeError(reason)
    shots = os.environ.get("PAGE_SHOTS", "")
    command = ["node", str(SCRIPT), str(package()), str(chromium()), shots, *map(str, files)]
    run = subprocess.run(command, capture_output=True, timeout=TIMEOUT_S, check=False)
    if run.returncode:
        raise RuntimeError(run.stderr.decode(errors="replace"))
    return [
        Visit(
            Path(found["file"]).name,
            None if found["ready_ms"] is None else found["ready_ms"] / 1000,
            found["words"],
            found["faults"],
            found["worst"],
        )
        for found in json.loads(run.stdout)
    ]


def missing() -> str:
    """Return why no page of ours can be opened, "" if one can."""
    return missing_browser() or pages.missing()


def missing_browser() -> str:
    """Return why there is no browser, "" if there is one."""
    if shutil.which("node") is None:
        return "node is not installed"
    if package() is None:
        return "playwright-core is not installed (npm install playwright-core, or set GLTF_PLAYWRIGHT_DIR)"
    if chromium() is None:
        return "Chromium is not installed (apt-get install chromium, or set CHROMIUM)"
    return ""


@cache
def package() -> Path | None:
    """Return the folder of the npm package `playwright-core`, None where it is absent."""
    given = (os.environ.get(name) for name in ("GLTF_PLAYWRIGHT_DIR", "GLTF_THREE_DIR", "GLTF_VALIDATOR_DIR"))
    for root in (*(Path(each).resolve() for each in given if each), ROOT):
        for folder in (root, root / "playwright-core", root / "node_modules" / "playwright-core"):
            if (folder / "index.js").is_file() and (folder / "cli.js").is_file():
                return folder
    return None


def chromium() -> str | None:
    """Return the path of the browser, None where it is absent."""
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), None)


if os.environ.get("REQUIRE_BROWSER") and missing():  # CI must not pass by skipping its judge
    raise RuntimeError(missing())

needs_browser = pytest.mark.skipif(bool(missing()), reason=missing() or "present")
