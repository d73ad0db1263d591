"""Configuration of `check`: `gltf-anim.toml`, or `[tool.gltf-anim]` of pyproject.toml, nearest upwards of a file."""

from __future__ import annotations

import glob
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path, PurePosixPath
from typing import Any

from anim.check.budget import MEASURES
from anim.check.finding import Severity
from anim.check.selection import RuleSelection
from anim.errors import AnimError
from cli import units
from cli.errors import UsageError
from cli.io import output_names
from cli.io.path_patterns import matches
from cli.workflows import config_tables

_SIZES = ("bytes", "animation_bytes")  # also as text with a unit, as --max-bytes
_KEYS: Mapping[str, config_tables.Keys] = {
    "": config_tables.SECTIONS,
    "check": {"select": list, "extend-select": list, "ignore": list, "target": str, "fail-on": str}
    | {"files": list, "params": dict},
    "check.files": {"match": str, "ignore": list},
    "budget": {"match": str, "error": str, "against": str}
    | dict.fromkeys(MEASURES, (int, float))
    | dict.fromkeys(_SIZES, (int, float, str)),
}


SUBFOLDER = "subfolder"  # placeholder: folders of a file below the fixed part of `match`
_AGAINST_HELP = "{subfolder}/{name} is the path below the folder of match: 'a/b.glb' of 'build/a/b.glb' for 'build/**'"


@dataclass(frozen=True)
class Budget:
    """Limits of matching files. error: as text, "0.5mm" or "0.1%"; against: the source, with {path}, {folder},
    {name}, {stem} or {subfolder}. place: number and file, "budget 2 of build/gltf-anim.toml"."""

    match: str
    limits: tuple[tuple[str, float], ...]
    error: str = ""
    against: str = ""
    place: str = ""


@dataclass(frozen=True)
class CheckConfig:
    """Settings of one configuration file; folder: its folder. files: pattern, and rules ignored in matching files."""

    path: str = ""
    folder: Path = field(default_factory=Path)
    select: Sequence[str] = ()
    extend: Sequence[str] = ()
    ignore: Sequence[str] = ()
    target: str = ""
    fail_on: Severity | None = None
    files: Sequence[tuple[str, Sequence[str]]] = ()
    parameters: Mapping[str, str] = field(default_factory=dict)
    budgets: Sequence[Budget] = ()

    def ignored_in(self, path: Path) -> Sequence[str]:
        """Return the rules ignored in a file: those of the first pattern that matches its path from the folder."""
        relative = self._relative(path)
        return next((ignored for pattern, ignored in self.files if matches(relative, pattern)), ())

    def budget_of(self, path: Path) -> Budget | None:
        """Return the first budget whose pattern matches the path of a file from the folder."""
        relative = self._relative(path)
        return next((each for each in self.budgets if matches(relative, each.match)), None)

    def source_of(self, path: Path, budget: Budget) -> Path:
        """Return the file that a file's error is measured against.

        Raises UsageError if `against` has placeholders and gives the file itself.
        """
        relative = self._relative(path)
        subfolder = PurePosixPath(relative).parent.relative_to(_fixed_folder(budget.match))
        source = self.folder / output_names.fill_path(budget.against, relative, subfolder=str(subfolder))
        if "{" in budget.against and os.path.realpath(source) == os.path.realpath(path):
            problem = f"`against` of the budget '{budget.match}' is the checked file itself: {relative}"
            raise UsageError(f"{self.path}: {problem}", help=_AGAINST_HELP)
        return source

    def _relative(self, path: Path) -> str:
        """Path from the folder, "" outside of it."""
        absolute = path.resolve()
        return absolute.relative_to(self.folder).as_posix() if absolute.is_relative_to(self.folder) else ""


def _fixed_folder(pattern: str) -> str:
    """The folders of a pattern before the first part with a wildcard: "build" of "build/**/*.glb"."""
    return "/".join(takewhile(lambda part: not glob.has_magic(part), pattern.split("/")[:-1])) or "."


def nearest(folder: Path) -> CheckConfig:
    """Return the configuration of a folder: the nearest one, from the folder upwards; an empty one without any."""
    found = config_tables.find_table(folder)
    return CheckConfig() if found is None else _config(*found)


def read_config(path: str) -> CheckConfig:
    """Return the configuration in a file."""
    return _config(Path(path), config_tables.read_table(path))


def _config(path: Path, table: dict[str, Any]) -> CheckConfig:
    config_tables.check_keys(path, "", table, _KEYS[""])
    about = table.get("check", {})
    config_tables.check_keys(path, "check", about, _KEYS["check"])
    for entry in about.get("files", ()):
        config_tables.check_keys(path, "check.files", entry, _KEYS["check.files"])
        if "match" not in entry:
            raise UsageError(f"{path}: [[check.files]] has no match")
    budgets = tuple(_budget(path, entry, number) for number, entry in enumerate(table.get("budget", ()), 1))
    try:
        fail_on = Severity(about["fail-on"]) if "fail-on" in about else None
    except ValueError:
        choices = ", ".join(Severity)
        raise UsageError(f"{path}: fail-on is '{about['fail-on']}' (expected one of {choices})") from None
    select, extend, ignore = (tuple(map(str, about.get(key, ()))) for key in ("select", "extend-select", "ignore"))
    return CheckConfig(
        str(path),
        path.resolve().parent,
        select,
        extend,
        ignore,
        target=about.get("target", ""),
        fail_on=fail_on,
        files=tuple((each["match"], tuple(map(str, each.get("ignore", ())))) for each in about.get("files", ())),
        parameters={key: str(value) for key, value in about.get("params", {}).items()},
        budgets=budgets,
    )


def _budget(path: Path, entry: Any, number: int) -> Budget:
    where = f"{path}: budget {number}"
    config_tables.check_keys(where, "budget", entry, _KEYS["budget"])
    for key in ("match", *(("against",) if "error" in entry else ())):
        if key not in entry:
            raise UsageError(f"{where}: [[budget]] has no {key}")
    if "\0" in entry.get("against", ""):
        raise UsageError(f"{where}: `against` of [[budget]] has a null character (no file name can)")
    try:
        output_names.check_placeholders(entry.get("against", ""), (*output_names.OF_PATHS, SUBFOLDER))
    except UsageError as error:
        raise UsageError(f"{where}: `against` of [[budget]] is {error}", help=_AGAINST_HELP) from None
    limits = tuple((name, _limit(where, name, entry[name])) for name in MEASURES if name in entry)
    text, against = entry.get("error", ""), entry.get("against", "")
    return Budget(entry["match"], limits, text, against, f"budget {number} of {_from_here(path)}")


def _limit(where: str, name: str, value: float | str) -> float:
    return float(units.parse_size(value, f"{where}: budget.{name}") if isinstance(value, str) else value)


def _from_here(path: Path) -> str:
    """Path from the current folder, as in an editor's list of files."""
    try:
        return Path(os.path.relpath(path)).as_posix()
    except ValueError:  # on another drive
        return path.as_posix()


def check_rules(config: CheckConfig) -> None:
    """Raise UsageError, with the configuration file's name, for an unknown rule, parameter or target."""
    try:
        RuleSelection(config.select, config.extend, config.ignore, config.target, config.parameters).check()
        for _, ignored in config.files:
            RuleSelection(ignore=ignored).check()
    except AnimError as error:
        raise UsageError(f"{config.path}: {error}", help=error.help) from None
