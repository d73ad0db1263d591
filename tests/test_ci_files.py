"""The scripts of the action and of the CI examples run under `bash -e`, and hooks name commands that exist."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from cli.command_table import COMMANDS
from docs.pages import run
from tests.cli.running import ROOT, built
from tests.pages import needs_page


def script_of_action(name: str = "Check") -> str:
    steps = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))["runs"]["steps"]
    (script,) = (str(step["run"]) for step in steps if step["name"] == name)
    return script


@pytest.mark.skipif(sys.platform == "win32", reason="bash and pip's scripts differ there")
@pytest.mark.parametrize(("fail_on", "code"), [("error", 0), ("info", 6)])
def test_the_action_annotates_sums_up_and_fails(fail_on: str, code: int, tmp_path: Path) -> None:
    (tmp_path / "noop.glb").write_bytes(built("noop"))
    variables = f"export FILES=. OPTIONS= FAIL_ON={fail_on} GITHUB_STEP_SUMMARY=summary.md; set -e\n"
    done = run(variables + script_of_action(), tmp_path)
    assert done.returncode == code, done.stdout
    assert "::warning file=noop.glb,title=GA101 wide-steps::" in done.stdout
    assert "| noop.glb | warning | GA101 wide-steps |" in (tmp_path / "summary.md").read_text("utf-8")
    assert json.loads((tmp_path / "gltf-anim.sarif").read_text("utf-8"))["version"] == "2.1.0"


@pytest.mark.skipif(sys.platform == "win32", reason="bash and pip's scripts differ there")
def test_the_action_finds_files_at_any_depth(tmp_path: Path) -> None:
    """Bash takes ** for *."""
    (tmp_path / "a/b/c").mkdir(parents=True)
    (tmp_path / "a/b/c/noop.glb").write_bytes(built("noop"))
    (tmp_path / "a/b/noop.glb").write_bytes(built("noop"))
    variables = "export FILES='a/**/*.glb' OPTIONS= FAIL_ON=error GITHUB_STEP_SUMMARY=summary.md; set -e\n"
    assert "file=a/b/c/noop.glb,title=GA101" in run(variables + script_of_action(), tmp_path).stdout


@pytest.mark.skipif(sys.platform == "win32", reason="bash and pip's scripts differ there")
@needs_page
def test_the_action_makes_pages_of_changed_files(tmp_path: Path) -> None:
    work, temp = tmp_path / "work", tmp_path / "temp"
    for each in (work, temp):
        each.mkdir()
    (work / "same.glb").write_bytes(built("tube"))
    git = "git -c user.name=a -c user.email=a@example.org -c init.defaultBranch=main"
    prepare = f"{git} init -q; git add .; {git} commit -qm base; git clone -q --bare . ../base.git; mkdir 'a b'\n"
    prepare += "git remote add origin ../base.git; git checkout -qb change\n"
    assert run(prepare, work).returncode == 0
    (work / "a b/new.glb").write_bytes(built("noop"))
    (work / "a b/bad.glb").write_bytes(b"no glTF")
    script = f"git add .; set -e; export BASE=main RUNNER_TEMP={shlex.quote(str(temp))}\n{script_of_action('Pages')}"
    done = run(script, work)
    assert done.returncode == 0, done.stdout
    assert [path.name for path in (temp / "gltf-anim").iterdir()] == ["a b_new.glb.html"]


def blocks(language: str) -> list[str]:
    """The examples of a language on the page about CI."""
    text = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def gitlab_script() -> list[str]:
    (job,) = (example["animations"] for each in blocks("yaml") if "animations" in (example := yaml.safe_load(each)))
    assert job["before_script"] == ["pip install gltf-anim"]
    assert job["artifacts"] == {"when": "always", "reports": {"junit": "findings.xml"}}
    return list(job["script"])


def jenkins_script() -> list[str]:
    (pipeline,) = blocks("groovy")
    assert pipeline.count("{") == pipeline.count("}")
    assert "always { junit 'findings.xml' }" in pipeline
    install, *script = re.findall(r"sh '(.*)'", pipeline)
    assert install == "pip install gltf-anim"
    return script


@pytest.mark.skipif(sys.platform == "win32", reason="bash and pip's scripts differ there")
@pytest.mark.parametrize("script", [gitlab_script, jenkins_script])
@pytest.mark.parametrize(("name", "code"), [("noop", 6), ("tube", 0)])
def test_the_examples_write_a_report_also_if_they_fail(
    script: Callable[[], list[str]], name: str, code: int, tmp_path: Path
) -> None:
    (tmp_path / "walk.glb").write_bytes(built(name))
    done = run("set -e\n" + "\n".join(script()), tmp_path)
    assert done.returncode == code, done.stdout
    cases = ElementTree.parse(tmp_path / "findings.xml").iter("testcase")
    assert [case.attrib["name"] for case in cases] == ["walk.glb"]


def test_all_examples_and_files_are_yaml() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
    hooks = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    github, _, hook = map(yaml.safe_load, blocks("yaml"))
    inputs = next(step["with"] for step in github["steps"] if "gltf-anim" in step["uses"])
    assert inputs.keys() <= action["inputs"].keys()
    assert [each["id"] for each in hook["repos"][0]["hooks"]] == [each["id"] for each in hooks]


def test_hooks_call_commands_of_the_table() -> None:
    text = (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
    entries = [shlex.split(line) for line in re.findall(r"entry: (.*)", text)]
    assert entries
    for program, command, *_ in entries:
        assert program == "gltf-anim"
        assert command in COMMANDS


def test_the_script_is_sound_bash() -> None:
    assert subprocess.run(["bash", "-n"], input=script_of_action().encode(), check=False).returncode == 0


def test_young_packages_have_upper_bounds() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = [*project["dependencies"], *(each for extra in project["optional-dependencies"].values() for each in extra)]
    for name in ("meshopt", "rapier3d", "typer"):
        assert any(line.startswith(name) and "<" in line for line in lines), name


def test_ci_runs_the_lowest_and_the_newest_and_audits() -> None:
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    for words in ("--resolution lowest-direct", "--resolution highest"):
        assert words in text
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert f"'.[{','.join(each for each in extras if each != 'test')}]' pip-audit" in text
