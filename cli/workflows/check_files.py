"""Files of `check`: rules from options and settings, fixes, budgets, and findings of each file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath

from anim.check.baseline import FileFinding
from anim.check.budget import ERROR, measure_budget
from anim.check.checked_file import CheckedFile
from anim.check.find import find_all
from anim.check.finding import Severity
from anim.check.rules.invalid import RULE as INVALID
from anim.check.rules.invalid import fault_occurrences
from anim.check.selection import RuleSelection
from anim.errors import AnimError, FormatError, UnsupportedError
from anim.files.special_files import is_device_or_pipe
from cli import units
from cli.errors import UsageError
from cli.io import documents, input_files
from cli.reports.check_report import SOURCE
from cli.text import DRY, Reporter, format_length
from cli.workflows import check_config, checked_files
from cli.workflows.check_config import Budget, CheckConfig


@dataclass(frozen=True, slots=True)
class RuleOptions:
    """Rules and parameters of the command line, which replace or extend those of a configuration."""

    select: Sequence[str] = ()
    extend: Sequence[str] = ()
    ignore: Sequence[str] = ()
    target: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)

    def selection(self, config: CheckConfig, path: str) -> RuleSelection:
        """Return the rules for a file."""
        chosen = RuleSelection(
            self.select or config.select,
            (*config.extend, *self.extend),
            (*config.ignore, *config.ignored_in(Path(path)), *self.ignore),
            self.target or config.target,
            {**config.parameters, **self.parameters},
        )
        chosen.check()
        return chosen


@dataclass
class FileChecker:
    """Checks files one by one, and collects what it finds.

    config: for all files, None for the nearest one of each. limits: severity by file from which on it fails.
    headroom: file, name, value and limit of each entry of a budget. unsafe: apply unsafe fixes too, None for no fix.
    """

    options: RuleOptions
    reporter: Reporter
    config: CheckConfig | None = None
    fail_on: Severity | None = None
    unsafe: bool | None = None
    dry_run: bool = False
    files: list[str] = field(default_factory=list)
    found: list[FileFinding] = field(default_factory=list)
    refused: list[tuple[str, AnimError]] = field(default_factory=list)
    limits: dict[str, Severity] = field(default_factory=dict)
    headroom: list[tuple[str, str, float, float]] = field(default_factory=list)
    _nearest: dict[Path, CheckConfig] = field(default_factory=dict)
    _configs: dict[str, CheckConfig] = field(default_factory=dict)
    _used: set[Budget] = field(default_factory=set)
    _is_search: bool = False

    def check_all(self, inputs: Sequence[str]) -> None:
        """Check files, folders and patterns.

        Sources of budgets that a search finds are not checked themselves, unless they have a budget of their own.
        """
        found = input_files.find(inputs)
        self._is_search = any(each.is_searched for each in found)
        sources = {source for each in found if (source := self._source_of(each.path))}
        for each in found:
            is_source = each.is_searched and os.path.realpath(each.path) in sources
            if not is_source or self._config(each.path).budget_of(Path(each.path)) is not None:
                self.check(each.path)

    def _source_of(self, path: str) -> str:
        """Real path of the file that the error of another one is measured against, "" without one."""
        if path in ("", documents.PIPE):
            return ""
        config = self._config(path)
        budget = config.budget_of(Path(path))
        if budget is None or not budget.error:
            return ""
        source = os.path.realpath(config.source_of(Path(path), budget))
        return source if source != os.path.realpath(path) else ""

    def check(self, path: str) -> None:
        """Fix a file, if wanted, and check it."""
        name = PurePath(documents.called(path)).as_posix()
        config = self._config(path)
        selection = self.options.selection(config, path)
        self.files.append(name)
        self.limits[name] = self.fail_on or config.fail_on or Severity.ERROR
        if self.unsafe is not None:
            self._fix(path, selection, unsafe=self.unsafe)
        try:
            with checked_files.open_checked(path) as (_, opened):
                file, source_faults = self._with_budget(opened, path, config)
                self.found += [(name, each) for each in find_all(file, selection)]
                self.headroom += [(name, *each) for each in measure_budget(file)]
                self._report_faults(name, source_faults)
                faults = (*file.facts.faults, *source_faults)
        except UsageError:
            raise
        except AnimError as error:
            faults = (checked_files.fault_of(path, error),)
            self._report_faults(name, faults)
        self.refused += [(name, fault) for fault in faults[:1]]

    def warn_of_unused_budgets(self) -> None:
        """Warn of budgets whose pattern matches no file of a search; a hook names only the files that changed."""
        if not self._is_search:
            return
        for config in self._configs.values():
            for budget in config.budgets:
                if budget not in self._used:
                    earlier = any(each.match == budget.match for each in config.budgets if each in self._used)
                    why = "has the pattern of an earlier one, which counts" if earlier else "matches no checked file"
                    self.reporter.warn(f"{config.path}: the budget '{budget.match}' {why}")

    def _report_faults(self, name: str, faults: Sequence[AnimError]) -> None:
        self.found += [(name, INVALID.finding([each], (), INVALID.severity)) for each in fault_occurrences(faults)]

    def _config(self, path: str) -> CheckConfig:
        folder = Path.cwd() if path == documents.PIPE else Path(path).resolve().parent
        if folder not in self._nearest:
            self._nearest[folder] = self.config or check_config.nearest(folder)
        config = self._nearest[folder]
        if config.path and config.path not in self._configs:
            check_config.check_rules(config)
            self._configs[config.path] = config
        return config

    def _with_budget(
        self, file: CheckedFile, path: str, config: CheckConfig
    ) -> tuple[CheckedFile, tuple[AnimError, ...]]:
        """The file with its limits, and with the source that its error is measured against; faults of the source.

        Without the source, all other limits hold.
        """
        budget = config.budget_of(Path(path))
        if budget is None:
            return file, ()
        self._used.add(budget)
        limited = replace(file, budget=dict(budget.limits), budget_place=budget.place)
        if not budget.error:
            return limited, ()
        source_path = str(config.source_of(Path(path), budget))
        try:
            _check_regular(source_path)
            with checked_files.open_checked(source_path) as (_, source):
                limit = units.parse_length(budget.error, f"error in {budget.place}", lambda: source.diagonal)
                return replace(limited, budget={**limited.budget, ERROR: limit}, source=source), ()
        except UsageError:
            raise
        except AnimError as error:
            fault = checked_files.fault_of(source_path, error)
            fault.where = f"{SOURCE} {PurePath(os.path.relpath(source_path, config.folder)).as_posix()}"
            fault.help = f"correct `against` in {budget.place}"
            return limited, (fault,)

    def _fix(self, path: str, selection: RuleSelection, *, unsafe: bool) -> None:
        """Fix a file in place; broken ones stay as they are, and are reported when they are checked."""
        from anim.check.fixing import fix_all  # imports what measures errors

        if path == documents.PIPE:
            raise UsageError("stdin can't be fixed in place: name files")
        with suppress(FormatError, UnsupportedError), checked_files.open_checked(path) as (source, file):
            try:
                result = fix_all(file, selection, unsafe=unsafe)
            except AnimError as error:
                self.reporter.warn(f"{source.name} is not fixed: {error}")
                return
            for each in result.refused:
                reason = each.problem or f"a vertex would move by {format_length(each.error_m)}"
                self.reporter.warn(f"{source.name}: {each.rule.code} {each.rule.name} is not fixed: {reason}")
            if result.applied:
                documents.write(
                    result.document, path, source, dry_run=self.dry_run, reporter=self.reporter, in_place=True
                )
                fixes = ", ".join(
                    f"{each.count} {each.rule.code} {each.rule.name} (error {format_length(each.error_m)})"
                    for each in result.applied
                )
                self.reporter.info(f"{source.name}  fixed {fixes}{DRY if self.dry_run else ''}")


def _check_regular(source: str) -> None:
    """Raise FormatError for a source that is a pipe or device, which a check would wait for without an end."""
    if is_device_or_pipe(source):
        raise FormatError("is no regular file")
