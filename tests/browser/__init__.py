"""Pages in real browsers: Chromium by the npm package `playwright-core`, Firefox by `puppeteer-core`, and WebKit.

The packages are looked for in the folders $GLTF_PLAYWRIGHT_DIR, $GLTF_THREE_DIR and $GLTF_VALIDATOR_DIR and in
`node_modules` beside pyproject.toml; Chromium and Firefox on the path, or as $CHROMIUM and $FIREFOX; WebKit is
WebKitGTK's MiniBrowser with WebKitWebDriver. Firefox and WebKit have WebGL only with a display, Xvfb if need be.
Tests that need Chromium carry `@needs_browser` and are skipped, with the reason, where it is absent; with
$REQUIRE_BROWSER set, absence is an error. Tests in the other engines call `missing` themselves.
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
EVALUATE = SCRIPT.with_name("evaluate.mjs")
CHROMIUM = "chromium"
OTHER_ENGINES = ("firefox", "webkit")
EXECUTABLES = {CHROMIUM: ("chromium", "chromium-browser", "google-chrome"), "firefox": ("firefox", "firefox-esr")}
PACKAGES = {CHROMIUM: "playwright-core", "firefox": "puppeteer-core"}
MINI_BROWSERS = ("usr/lib/*/webkit2gtk-4.*/MiniBrowser", "usr/libexec/webkit2gtk-4.*/MiniBrowser")
DISPLAY = ("xvfb-run", "-a", "-s", "-screen 0 1280x900x24")
TIMEOUT_S = 1800  # for one call
NO_ENGINE = 3  # exit code of the script


class EngineError(RuntimeError):
    """A browser is there, and does not start or has no WebGL."""


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


def visit(files: Sequence[Path], engine: str = CHROMIUM) -> list[Visit]:
    """Open pages one after the other, try keys and scrubber; in Chromium on a phone too, by touch.

    $PAGE_SHOTS names a folder that keeps a picture of each. Raises EngineError where the browser does not start.
    """
    if reason := missing(engine):
        raise RuntimeError(reason)
    shots = os.environ.get("PAGE_SHOTS", "")
    if shots:
        Path(shots).mkdir(parents=True, exist_ok=True)
    task = {
        "engine": engine,
        "library": str(shutil.which("WebKitWebDriver") if engine == "webkit" else package(engine)),
        "executable": str(executable(engine)),
        "shots": shots,
        "files": [str(each) for each in files],
    }
    command = [*_display(engine), "node", str(SCRIPT), json.dumps(task)]
    environment = os.environ if engine == CHROMIUM else {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"}
    try:
        run = subprocess.run(command, capture_output=True, timeout=TIMEOUT_S, check=False, env=environment)
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"{engine} did not end within {TIMEOUT_S} s") from None
    if run.returncode == NO_ENGINE:
        raise EngineError(run.stderr.decode(errors="replace"))
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


def evaluate(file: Path, visits: Sequence[tuple[str, Sequence[str]]]) -> list[list[Any]]:
    """Open a page in Chromium at addresses, each "#…" or "", and return the values of code there, and its messages."""
    about = {"library": str(package()), "executable": str(executable())}
    visited = [{"file": str(file), "hash": hash, "codes": list(codes)} for hash, codes in visits]
    command = ["node", str(EVALUATE), json.dumps({**about, "visits": visited})]
    run = subprocess.run(command, capture_output=True, timeout=TIMEOUT_S, check=False)
    if run.returncode:
        raise RuntimeError(run.stderr.decode(errors="replace"))
    return list(json.loads(run.stdout))


def missing(engine: str = CHROMIUM) -> str:
    """Return why no page of ours can be opened, "" if one can."""
    return missing_browser(engine) or pages.missing()


def missing_browser(engine: str = CHROMIUM) -> str:
    """Return why there is no browser, "" if there is one."""
    if shutil.which("node") is None:
        return "node is not installed"
    if engine in PACKAGES and package(engine) is None:
        return f"{PACKAGES[engine]} is not installed (npm install {PACKAGES[engine]}, or set GLTF_PLAYWRIGHT_DIR)"
    if engine == "webkit" and shutil.which("WebKitWebDriver") is None:
        return "WebKitWebDriver is not installed (apt-get install webkit2gtk-driver)"
    if executable(engine) is None:
        return f"{engine} is not installed (apt-get install it, or set {engine.upper()})"
    if engine != CHROMIUM and not _display(engine) and not os.environ.get("DISPLAY"):
        return f"{engine} has no WebGL without a display (apt-get install xvfb xauth)"
    return ""


@cache
def package(engine: str = CHROMIUM) -> Path | None:
    """Return the folder of the npm package that drives an engine, None where it is absent."""
    name = PACKAGES[engine]
    given = (os.environ.get(each) for each in ("GLTF_PLAYWRIGHT_DIR", "GLTF_THREE_DIR", "GLTF_VALIDATOR_DIR"))
    for root in (*(Path(each).resolve() for each in given if each), ROOT):
        for folder in (root, root / name, root / "node_modules" / name):
            if folder.name == name and (folder / "package.json").is_file():
                return folder
    return None


def executable(engine: str = CHROMIUM) -> str | None:
    """Return the path of the browser, None where it is absent."""
    if given := os.environ.get(engine.upper()):
        return given
    if engine == "webkit":
        found = (each for pattern in MINI_BROWSERS for each in sorted(Path("/").glob(pattern)))
        return next(map(str, found), None)
    return next(filter(None, map(shutil.which, EXECUTABLES[engine])), None)


def _display(engine: str) -> tuple[str, ...]:
    return DISPLAY if engine != CHROMIUM and shutil.which("xvfb-run") and shutil.which("xauth") else ()


if os.environ.get("REQUIRE_BROWSER") and missing():  # CI must not pass by skipping its judge
    raise RuntimeError(missing())

needs_browser = pytest.mark.skipif(bool(missing()), reason=missing() or "present")
