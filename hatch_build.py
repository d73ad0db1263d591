"""Build hook: the script of the pages of `gltf-anim view`, bundled where wheels, sdists and editable installs are made.

$GLTF_ANIM_PAGE=0 skips it. Without npm, Node.js comes as a wheel; where the build fails, the install goes on without
the script, and `view` names the command that builds it.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

BUILDER = Path("anim", "show", "page", "build", "__main__.py")
MACHINES = ("x86_64", "amd64", "aarch64", "arm64")  # for which Node.js exists as a wheel
SYSTEMS = ("Linux", "Darwin", "Windows")


class PageHook(BuildHookInterface):  # type: ignore[type-arg]
    """Hook named `custom` in pyproject.toml."""

    def dependencies(self) -> list[str]:
        """Return what the build needs besides hatchling: Node.js, if there is no npm."""
        builder = self._builder()
        has_wheel = platform.system() in SYSTEMS and platform.machine().lower() in MACHINES
        needs_wheel = self._is_wanted(builder) and not shutil.which("npm") and has_wheel
        return [f"{builder.NODE_WHEEL}>=22"] if needs_wheel else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the bundle unless it is there and current; the target packs it as an artifact."""
        builder = self._builder()
        if not self._is_wanted(builder):
            return
        try:
            builder.build()
        except builder.BuildError as error:
            self.app.display_warning(f"without the pages of `gltf-anim view`: {error}")

    def _is_wanted(self, builder: ModuleType) -> bool:
        return os.environ.get("GLTF_ANIM_PAGE") != "0" and not builder.is_current()

    def _builder(self) -> ModuleType:
        """The module that builds, from its file: the package's dependencies are not installed here."""
        spec = importlib.util.spec_from_file_location("page_build", Path(self.root, BUILDER))
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
