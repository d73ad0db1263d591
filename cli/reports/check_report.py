"""Reports of `check`: text, JSON, and Markdown for the summary of a job."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from anim.check.baseline import FileFinding, fingerprint
from anim.check.finding import Finding, Severity
from anim.errors import AnimError
from anim.units import list_some, plural
from cli import tables
from cli.reports import json_report
from cli.tables import escape_control

SCHEMA = 1
SOURCE = "source"  # begins the position of errors in the source of a budget
MAX_FAILED_FILES = 10  # in the line about a check that failed
MAX_OF_RULE = 3  # findings of a rule listed per file in the text
MAX_SUMMARY_BYTES = 1_000_000  # of a job summary on GitHub, 1 MiB
MARKDOWN_ESCAPES = {ord(c): f"&#{ord(c)};" if c in "<>|&" else f"\\{c}" for c in "\\`*_{}[]<>#|~&"}


def is_of_source(error: AnimError) -> bool:
    """Return whether an error is that of a file's source, not of the file."""
    return error.where.startswith(f"{SOURCE} ")


@dataclass(frozen=True, slots=True)
class CheckReport:
    """Result of a check. files: paths of all files. found: new findings. refused: unreadable files.

    limits: severity by file from which on a finding fails the check; errors without one.
    known: number of findings in the baseline; gone: fingerprints of those that no longer exist, with their counts.
    """

    files: Sequence[str]
    found: Sequence[FileFinding]
    refused: Sequence[tuple[str, AnimError]]
    limits: Mapping[str, Severity] = field(default_factory=dict)
    known: int = 0
    gone: Sequence[tuple[str, int]] = ()

    def is_failure(self, path: str, finding: Finding) -> bool:
        """Return whether a finding fails the check."""
        return finding.severity.is_at_least(self.limits.get(path, Severity.ERROR))

    def count(self, severity: Severity) -> int:
        """Return the number of findings of a severity."""
        return sum(finding.severity is severity for _, finding in self.found)


def text(report: CheckReport) -> str:
    """Return the findings by file and rule, with the advice of each rule, and a summary."""
    lines = _findings(report.found)
    lines += ["", summary(report)] if lines else [summary(report)]
    return "\n".join(map(escape_control, lines)) + "\n"


def error_text(report: CheckReport) -> str:
    """Return only what fails the check of the text, "" without it: even a quiet check shows that."""
    lines = _findings([each for each in report.found if report.is_failure(*each)])
    return "".join(f"{escape_control(line)}\n" for line in lines)


def count_failures(names: Sequence[str]) -> str:
    """Return words on the other findings that fail a check, after the first one. names: the file of each finding."""
    counts = Counter(names)
    if len(counts) < 2:
        return f" and {len(names) - 1} more" if len(names) > 1 else ""
    listed = list_some([f"{name} {count}" for name, count in counts.items()], MAX_FAILED_FILES)
    return f"; {len(names)} findings in {len(counts)} files: {listed}"


def _findings(listed: Sequence[FileFinding]) -> list[str]:
    lines: list[str] = []
    previous = None
    for (path, code), group in groupby(listed, key=lambda each: (each[0], each[1].code)):
        if path != previous:
            lines += [*([""] if lines else []), path]
        previous = path
        found = [each for _, each in group]
        shown = found if len(found) <= MAX_OF_RULE + 1 else found[:MAX_OF_RULE]
        lines += [f"  {each.severity:7}  {code} {each.name}  {each.where}: {each.problem}" for each in shown]
        if len(shown) < len(found):
            lines.append(f"           and {len(found) - len(shown)} more of this rule (all: --format json)")
        lines += [f"           {advice}" for advice in dict.fromkeys(each.advice for each in shown)]
    return lines


def summary(report: CheckReport) -> str:
    """Return one line: files, findings by severity, fixable ones, known and gone ones."""
    counts = [plural(report.count(each), each.value) for each in (Severity.ERROR, Severity.WARNING)]
    counts.append(f"{report.count(Severity.INFO)} info")
    line = f"{plural(len(report.files), 'file')} checked: {', '.join(counts)}"
    fixes = [each.fixable for _, each in report.found]
    if safe := fixes.count("safe"):
        line += f"; {safe} fixable with --fix"
    if unsafe := fixes.count("unsafe"):
        line += f"; {unsafe} more with --unsafe-fixes" if safe else f"; {unsafe} fixable with --unsafe-fixes"
    if report.known:
        line += f"; {report.known} known from the baseline"
    if report.gone:
        count = sum(count for _, count in report.gone)
        line += f"; {count} in the baseline no longer found (--write-baseline renews it)"
    if unread := sum(not is_of_source(error) for _, error in report.refused):
        line += f"; {plural(unread, 'file')} unreadable"
    if of_sources := len(report.refused) - unread:
        line += f"; {plural(of_sources, 'source')} unreadable"
    return line


def budget_table(rows: Sequence[tuple[str, str, float, float]]) -> str:
    """Return a table of file, name, value and limit, with the fraction of the limit that is used."""
    cells: list[list[tables.Cell]] = [
        [path, name, value, limit, f"{100 * value / limit:.0f} %" if limit else ""] for path, name, value, limit in rows
    ]
    if not cells:
        return "no checked file has a budget\n"
    return tables.text(["file", "budget", "value", "limit", "used"], cells, left=2, indent="")


def budget_json(rows: Sequence[tuple[str, str, float, float]]) -> str:
    """Return the rows of `budget_table` as one JSON document; the units are those of the budgets."""
    named = [dict(zip(("file", "budget", "value", "limit"), row, strict=True)) for row in rows]
    return json_report.dump({"schema": SCHEMA, "budgets": named})


def as_json(report: CheckReport) -> str:
    """Return one JSON document."""
    content = {
        "schema": SCHEMA,
        "files": list(report.files),
        "findings": [
            {"file": path, **each._asdict(), "fingerprint": fingerprint(path, each)} for path, each in report.found
        ],
        "errors": [{"file": path, "error": str(error)} for path, error in report.refused],
        "known": report.known,
        "gone": dict(report.gone),
        "counts": {each.value: report.count(each) for each in Severity},
    }
    return json_report.dump(content)


def as_markdown(report: CheckReport) -> str:
    """Return a table for the summary of a job, cut where GitHub would refuse it."""
    lines = [f"**{summary(report)}**", ""]
    if report.found:
        lines += ["| file | severity | rule | where | problem |", "|---|---|---|---|---|"]
    size = sum(len(line.encode()) + 1 for line in lines)
    for i, (path, each) in enumerate(report.found):
        cells = (path, each.severity.value, f"{each.code} {each.name}", each.where, each.problem)
        line = "| " + " | ".join(_cell(cell) for cell in cells) + " |"
        size += len(line.encode()) + 1
        if size > MAX_SUMMARY_BYTES:
            lines += ["", f"and {len(report.found) - i} more findings"]
            break
        lines.append(line)
    return "\n".join(lines) + "\n"


def _cell(words: str) -> str:
    """Text in a table of Markdown, where names of a file are plain text."""
    return escape_control(words).translate(MARKDOWN_ESCAPES)
