"""`gltf-anim check`: rules over files, for CI."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from enum import StrEnum
from pathlib import Path, PurePath
from textwrap import fill
from typing import Annotated

import typer

from anim.check import baseline
from anim.check.find import find_all
from anim.check.finding import Finding, Severity
from anim.check.fixing import fix_all
from anim.check.registry import RULES
from anim.check.rule import Rule
from anim.check.rules.invalid import RULE as INVALID
from anim.check.rules.invalid import fault_occurrences
from anim.check.selection import TARGETS, RuleSelection, rule_of
from anim.errors import AnimError, FormatError
from cli import errors, tables
from cli.errors import CheckError, UsageError
from cli.io import documents, input_files
from cli.options import common
from cli.reports import check_ci, check_report
from cli.reports.check_report import CheckReport
from cli.text import Reporter, format_length
from cli.workflows import check_config, checked_files
from cli.workflows.check_config import CheckConfig
from cli.workflows.edit_clips import DRY

Target = StrEnum("Target", [(name, name) for name in TARGETS])  # type: ignore[misc]
WIDTH = 100  # of --explain
MAX_NAMED_FILES = 3  # in the line about unreadable files


class Format(StrEnum):
    """Report format."""

    TEXT = "text"
    JSON = "json"
    MD = "md"
    GITHUB = "github"
    SARIF = "sarif"
    JUNIT = "junit"


WRITERS = {
    Format.TEXT: check_report.text,
    Format.JSON: check_report.as_json,
    Format.MD: check_report.as_markdown,
    Format.GITHUB: check_ci.as_github,
    Format.SARIF: check_ci.as_sarif,
    Format.JUNIT: check_ci.as_junit,
}


def command(
    inputs: Annotated[
        list[str] | None,
        typer.Argument(metavar="FILE...", help="Files, folders, or patterns; '-' for stdin.", show_default=False),
    ] = None,
    *,
    select: Annotated[
        list[str] | None,
        typer.Option("--select", metavar="RULE", help="Only these rules: a code, its beginning, a name, or ALL."),
    ] = None,
    extend: Annotated[
        list[str] | None, typer.Option("--extend-select", metavar="RULE", help="Also these rules, off by default.")
    ] = None,
    ignore: Annotated[list[str] | None, typer.Option("--ignore", metavar="RULE", help="Not these rules.")] = None,
    target: Annotated[
        Target | None, typer.Option("--target", help="The player: its severities count.", show_default=False)
    ] = None,
    param: Annotated[
        list[str] | None,
        typer.Option("--param", metavar="RULE.NAME=VALUE", help="Parameter of a rule: GA201.influences=8."),
    ] = None,
    fail_on: Annotated[
        Severity | None,
        typer.Option("--fail-on", help="Exit 6 for this severity or a worse one.  [default: error]"),
    ] = None,
    format: Annotated[Format, typer.Option("--format", help="Report format.")] = Format.TEXT,
    known: Annotated[
        str | None, typer.Option("--baseline", metavar="FILE", help="Known findings, which are not reported.")
    ] = None,
    write_known: Annotated[
        str | None, typer.Option("--write-baseline", metavar="FILE", help="Write all findings as a baseline; exit 0.")
    ] = None,
    config: Annotated[
        str | None,
        typer.Option("--config", metavar="FILE", help="Settings for all files, instead of the nearest gltf-anim.toml."),
    ] = None,
    fix: Annotated[bool, typer.Option("--fix", help="Apply safe fixes, in place.")] = False,
    unsafe: Annotated[
        bool, typer.Option("--unsafe-fixes", help="Apply all fixes, in place; each prints its largest error.")
    ] = False,
    dry_run: common.DryRun = False,
    list_rules: Annotated[bool, typer.Option("--list", help="List the rules.")] = False,
    explain: Annotated[
        str | None, typer.Option("--explain", metavar="RULE", help="Explain a rule: reason, parameters, fix.")
    ] = None,
    quiet: common.Quiet = False,
) -> int:
    """Check files by rules, and fail on errors.

    Each finding has a rule with a code (GA101) and a name, the part of the file, and advice. --list shows all rules,
    --explain one of them. Exit codes: 0; 6 for a finding of the severity --fail-on or a worse one; 3 for unreadable
    files, the others are checked all the same.

    --fix changes files in place: only what moves no vertex by more than 1e-6 of the model's size, measured on the
    written file; --unsafe-fixes everything that has a fix. What is left is reported. A second run changes nothing.

    Settings are read from the nearest gltf-anim.toml, or [tool.gltf-anim] in pyproject.toml, from the file's folder
    upwards; options replace them:

    \b
        [check]
        ignore = ["GA113"]
        fail-on = "warning"
        params = {"GA201.influences" = 8}
        [[check.files]]
        match = "crowd/**"
        ignore = ["GA2"]

    --write-baseline keeps the findings of today, by rule, file and part; with --baseline only new ones count.
    --format github prints annotations, sarif is for code scanning, junit for test reports, md for job summaries.
    """
    if explain is not None:
        documents.write_text(_explanation(rule_of(explain)))
        return errors.DONE
    if list_rules:
        documents.write_text(_rule_table())
        return errors.DONE
    if known is not None and write_known is not None:
        raise UsageError("--baseline and --write-baseline can't be combined")
    if unsafe and known is not None:
        raise UsageError("--unsafe-fixes and --baseline can't be combined")
    fixed = None if config is None else check_config.read_config(config)
    options = _Options(select or (), extend or (), ignore or (), str(target or ""), _parameters(param or ()))
    expected = None if known is None else _load_baseline(known)
    voice = Reporter(quiet)
    files, found, refused = [], [], []
    limits: dict[str, Severity] = {}
    for path in input_files.expand(inputs or [documents.PIPE]):
        name = PurePath(documents.called(path)).as_posix()
        settings = fixed or check_config.nearest(_folder(path))
        files.append(name)
        limits[name] = fail_on or settings.fail_on or Severity.ERROR
        selection = options.selection(settings, path)
        if fix or unsafe:
            _fix_file(path, selection, voice, unsafe=unsafe, dry_run=dry_run)
        findings, error = _check_file(path, selection)
        found += [(name, each) for each in findings]
        refused += [(name, error)] if error is not None else []
    if write_known is not None:
        documents.write_text(baseline.dump(found), write_known)
        voice.info(f"{write_known}  {len(found)} findings")
        return _worst(refused, len(files))
    return _report(CheckReport(files, found, refused), expected, limits, format, quiet=quiet)


class _Options:
    """Rules and parameters of the command line, which replace or extend those of a configuration."""

    def __init__(
        self,
        select: Sequence[str],
        extend: Sequence[str],
        ignore: Sequence[str],
        target: str,
        parameters: Mapping[str, str],
    ) -> None:
        split = [[word for each in words for word in each.split(",")] for words in (select, extend, ignore)]
        self.select, self.extend, self.ignore = split
        self.target, self.parameters = target, parameters
        self._checked: set[str] = set()

    def selection(self, config: CheckConfig, path: str) -> RuleSelection:
        """Return the rules for a file."""
        if config.path and config.path not in self._checked:
            check_config.check_rules(config)
            self._checked.add(config.path)
        chosen = RuleSelection(
            self.select or config.select,
            (*config.extend, *self.extend),
            (*config.ignore, *config.ignored_in(Path(path)), *self.ignore),
            self.target or config.target,
            {**config.parameters, **self.parameters},
        )
        chosen.check()
        return chosen


def _check_file(path: str, selection: RuleSelection) -> tuple[Sequence[Finding], AnimError | None]:
    """Findings of a file, and the error for which other commands refuse it."""
    try:
        with checked_files.open_checked(path) as (_, file):
            faults = file.facts.faults
            return find_all(file, selection), faults[0] if faults else None
    except AnimError as error:
        fault = checked_files.fault_of(path, error)
        return [INVALID.finding([each], (), INVALID.severity) for each in fault_occurrences([fault])], fault


def _fix_file(path: str, selection: RuleSelection, voice: Reporter, *, unsafe: bool, dry_run: bool) -> None:
    """Fix a file in place; broken ones stay as they are, and are reported when they are checked."""
    if path == documents.PIPE:
        raise UsageError("stdin can't be fixed in place: name files")
    with suppress(FormatError), checked_files.open_checked(path) as (source, file):
        result = fix_all(file, selection, unsafe=unsafe)
        for each in result.refused:
            error = format_length(each.error_m)
            voice.warn(f"{source.name}: {each.rule.code} {each.rule.name} is not fixed: a vertex would move by {error}")
        if result.applied:
            documents.write(result.document, path, source, dry_run=dry_run, voice=voice)
            fixes = ", ".join(
                f"{each.count} {each.rule.code} {each.rule.name} (error {format_length(each.error_m)})"
                for each in result.applied
            )
            voice.info(f"{source.name}  fixed {fixes}{DRY if dry_run else ''}")


def _report(
    report: CheckReport,
    expected: Counter[str] | None,
    limits: Mapping[str, Severity],
    format: Format,
    *,
    quiet: bool,
) -> int:
    if expected is not None:
        new, gone = baseline.split(report.found, expected)
        known = len(report.found) - len(new)
        report = CheckReport(report.files, new, report.refused, known, sorted(gone.items()))
    if format is not Format.TEXT or not quiet:
        documents.write_text(WRITERS[format](report))
    worst = _worst(report.refused, len(report.files))
    counted = [each for each in report.found if each[1].code != INVALID.code]
    bad = [each for each in counted if each[1].severity.is_at_least(limits[each[0]])]
    if bad and not worst:
        name, first = bad[0]
        more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise CheckError(f"{name}: {first.severity} {first.code} {first.name}: {first.where}: {first.problem}{more}")
    return worst


def _worst(refused: Sequence[tuple[str, AnimError]], files: int) -> int:
    """Report unreadable files in one line; the exit code."""
    if len(refused) < 2:
        return max((errors.report_error(error.at(name, ": ")) for name, error in refused), default=errors.DONE)
    names = ", ".join(name for name, _ in refused[:MAX_NAMED_FILES]) + (", …" if len(refused) > MAX_NAMED_FILES else "")
    return errors.report_error(FormatError(f"{len(refused)} of {files} files can't be read: {names}"))


def _parameters(words: Sequence[str]) -> dict[str, str]:
    found = {}
    for each in words:
        key, separator, value = each.partition("=")
        if not separator:
            raise UsageError(f"--param is '{each}' (expected RULE.NAME=VALUE, like GA201.influences=8)")
        found[key] = value
    return found


def _load_baseline(path: str) -> Counter[str]:
    with documents.content(path, ending=".json") as (data, _):
        return baseline.load(data.tobytes().decode(errors="replace"))


def _folder(path: str) -> Path:
    return Path.cwd() if path == documents.PIPE else Path(path).resolve().parent


def _rule_table() -> str:
    rows: list[list[tables.Cell]] = [
        [rule.code, rule.name, rule.severity.value if rule.is_default else "off", _fix(rule), rule.about]
        for rule in sorted(RULES, key=lambda rule: rule.code)
    ]
    return tables.text(["rule", "name", "severity", "fix", "finds"], rows, left=5, indent="")


def _fix(rule: Rule) -> str:
    return "" if rule.fix is None else "safe" if rule.fix.is_safe else "unsafe"


def _explanation(rule: Rule) -> str:
    level = rule.severity.value if rule.is_default else f"{rule.severity.value}, off by default (--extend-select)"
    lines = [f"{rule.code} {rule.name}  [{level}]", "", rule.about, "", fill(rule.why, WIDTH)]
    lines += [f"With --target {target}: {severity}." for target, severity in rule.targets.items()]
    if rule.advice:
        advice = rule.advice.format(fps="FPS", finer="FPS", clips="")
        lines += ["", fill(f"Advice: {advice}", WIDTH)]
    if rule.fix is not None:
        lines += ["", f"Fix ({_fix(rule)}): {rule.fix.about}"]
    for name, each in rule.parameters.items():
        unit = "" if each.unit == "%" else each.unit
        lines += ["", f"--param {rule.code}.{name}={each.default:g}{unit}  {each.about}"]
    return "\n".join(lines) + "\n"
