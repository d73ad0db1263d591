"""`gltf-anim check`: rules over files, for CI."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from anim.check import baseline
from anim.check.finding import Severity
from anim.check.rules.invalid import RULE as INVALID
from anim.check.selection import TARGETS, rule_of
from anim.errors import AnimError, FormatError
from anim.files import guard, resolver
from anim.units import plural
from cli import errors
from cli.errors import CheckError, UsageError
from cli.io import documents, stdout
from cli.options import common
from cli.reports import check_ci, check_report, rule_list
from cli.reports.check_report import CheckReport
from cli.text import Reporter
from cli.workflows import check_config
from cli.workflows.check_files import FileChecker, RuleOptions

Target = StrEnum("Target", [(name, name) for name in TARGETS])  # type: ignore[misc]
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
        typer.Argument(
            metavar="FILE...", help="Files, folders ('.'), or patterns; '-' or none: stdin.", show_default=False
        ),
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
    budget_report: Annotated[
        bool,
        typer.Option(
            "--budget-report",
            help="Only list the values of budgets with their limits, as text or JSON; exit 0 above them too.",
        ),
    ] = False,
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
        [[budget]]
        match = "crowd/**"
        bytes = 500_000
        error = "0.5mm"
        against = "source/{path}"

    --write-baseline keeps the findings of today, by rule, file and part; with --baseline only new ones count. Those of
    files that are not checked, and still exist, stay in it.
    Budgets limit bytes, animation_bytes, keys, keys_per_second, seconds, clips, joints, targets, and the error against
    a source. against takes {path}, the file's path from the folder of the settings, {folder}, {name}, {stem} (the name
    without extension) and {subfolder}, the folders below those of match: against = "{subfolder}/{stem}.gltf" for
    match = "build/**". --budget-report only shows the values beside the limits: without it a limit that is exceeded is
    the error GA402, exit 6.
    `run` checks its outputs with --check only.
    --format github prints annotations, sarif is for code scanning, junit for test reports, md for job summaries.
    """
    if explain is not None:
        documents.write_text(rule_list.explain(rule_of(explain)))
        return errors.DONE
    if list_rules:
        documents.write_text(rule_list.rule_table())
        return errors.DONE
    if known is not None and write_known is not None:
        raise UsageError("--baseline and --write-baseline can't be combined")
    if budget_report and format not in (Format.TEXT, Format.JSON):
        raise UsageError(f"--budget-report is text or JSON (got --format {format})")
    if write_known is not None and write_known != documents.PIPE:
        documents.check_file(write_known)
    expected = None if known is None else _load_baseline(known)
    reporter = Reporter(quiet)
    rules = [[word for each in option or () for word in each.split(",")] for option in (select, extend, ignore)]
    checker = FileChecker(
        RuleOptions(rules[0], rules[1], rules[2], str(target or ""), _parameters(param or ())),
        reporter,
        None if config is None else check_config.read_config(config),
        fail_on,
        unsafe if fix or unsafe else None,
        dry_run,
    )
    checker.check_all(inputs or [documents.PIPE])
    for _, error in () if inputs else checker.refused:
        if error.problem.startswith("is empty"):  # as in CI, without a pipe
            error.help = "without FILE, stdin is read; for all files below this folder: gltf-anim check ."
    checker.warn_of_unused_budgets()
    if budget_report:
        as_text = check_report.budget_json if format is Format.JSON else check_report.budget_table
        documents.write_text(as_text(checker.headroom))
        return _worst(checker.refused, len(checker.files))
    if write_known is not None:
        kept = _unchecked(_written_baseline(write_known), checker.files, write_known)
        documents.write_text(baseline.dump(checker.found, _relative_to(write_known), kept), write_known)
        others = f", {kept.total()} kept of files that were not checked" if kept else ""
        reporter.info(f"{write_known}  {plural(len(checker.found), 'finding')}{others}")
        return _worst(checker.refused, len(checker.files))
    report = CheckReport(checker.files, checker.found, checker.refused, checker.limits)
    if expected is not None and known is not None:
        expected -= _unchecked(expected, report.files, known)
        new, gone = baseline.split(report.found, expected, _relative_to(known))
        report = replace(report, found=new, known=len(report.found) - len(new), gone=sorted(gone.items()))
    return _report(report, format, quiet=quiet)


def _report(
    report: CheckReport,
    format: Format,
    *,
    quiet: bool,
) -> int:
    if format is Format.TEXT and quiet:
        documents.write_text(check_report.error_text(report))
    else:
        documents.write_text(WRITERS[format](report))
    is_read = format is Format.TEXT and stdout.is_read_with_stderr()
    invalid = {name for name, each in report.found if each.code == INVALID.code}
    worst = _worst(report.refused, len(report.files), shown=invalid if is_read else ())
    counted = [each for each in report.found if each[1].code != INVALID.code]
    bad = [each for each in counted if report.is_failure(*each)]
    if bad and not worst:
        order = list(Severity)  # most severe first
        name, first = min(bad, key=lambda each: order.index(each[1].severity))
        more = check_report.count_failures([path for path, _ in bad])
        error = CheckError(f"{name}: {first.severity} {first.code} {first.name}: {first.where}: {first.problem}{more}")
        return errors.report_error(error, is_shown=is_read and first.severity is Severity.ERROR)
    return worst


def _worst(refused: Sequence[tuple[str, AnimError]], files: int, shown: Collection[str] = ()) -> int:
    """Report unreadable files in one line; the exit code. shown: those whose errors the user has read."""
    is_shown = all(name in shown for name, _ in refused)
    if len(refused) < 2:
        codes = (errors.report_error(error.at(name, ": "), is_shown=is_shown) for name, error in refused)
        return max(codes, default=errors.DONE)
    unread = [name for name, error in refused if not check_report.is_of_source(error)]
    of_sources = [name for name, error in refused if check_report.is_of_source(error)]
    problems = [f"{len(unread)} of {files} files can't be read: {_names(unread)}"] if unread else []
    if of_sources:
        problems.append(f"the sources of {len(of_sources)} of {files} files can't be read: {_names(of_sources)}")
    return errors.report_error(FormatError("; ".join(problems)), is_shown=is_shown)


def _names(names: Sequence[str]) -> str:
    return ", ".join(names[:MAX_NAMED_FILES]) + (", …" if len(names) > MAX_NAMED_FILES else "")


def _parameters(words: Sequence[str]) -> dict[str, str]:
    found = {}
    for each in words:
        key, separator, value = each.partition("=")
        if not separator:
            raise UsageError(f"--param is '{each}' (expected RULE.NAME=VALUE, like GA201.influences=8)")
        found[key] = value
    return found


def _relative_to(path: str) -> Callable[[str], str]:
    """Names of files as a baseline has them: relative to its folder, wherever the command is run."""
    folder = Path.cwd() if path == documents.PIPE else Path(path).resolve().parent
    return lambda name: name if name == documents.called(documents.PIPE) else _relative(Path(name).resolve(), folder)


def _unchecked(known: Counter[str], files: Sequence[str], path: str) -> Counter[str]:
    """Counts in a baseline of other files than the checked ones: a hook checks only files that changed."""
    stdin, folder = documents.called(documents.PIPE), Path(path).resolve().parent
    checked = set(map(_relative_to(path), files))
    return baseline.unchecked(known, checked, lambda name: name == stdin or os.path.isfile(folder / name))


def _written_baseline(path: str) -> Counter[str]:
    """Counts in a baseline that is to be replaced; none if there is no baseline at `path`."""
    try:
        with guard.use(None):  # which it may replace
            return _load_baseline(path) if path != documents.PIPE and os.path.isfile(path) else Counter()
    except FormatError:
        return Counter()


def _relative(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive
        return path.as_posix()


def _load_baseline(path: str) -> Counter[str]:
    with documents.content(path, ending=".json", read=resolver.read_options) as (data, _):
        return baseline.load(data.tobytes().decode(errors="replace"))
