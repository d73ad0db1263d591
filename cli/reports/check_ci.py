"""Reports of `check` for CI systems: annotations of GitHub Actions, SARIF 2.1.0, JUnit XML."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote
from xml.etree import ElementTree

from anim import __version__
from anim.check.baseline import fingerprint
from anim.check.finding import Finding, Severity
from anim.check.registry import RULES
from anim.check.rules.invalid import RULE as INVALID
from cli.reports import json_report
from cli.reports.check_report import CheckReport, summary
from cli.tables import escape_control

COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
MAX_ANNOTATIONS = 10  # per severity and step that GitHub shows
HOME = "https://pypi.org/project/gltf-anim/"
MAX_RESULTS = 25_000  # of a run; GitHub refuses files with more
SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def as_github(report: CheckReport) -> str:
    """Return workflow commands: at most ten of a severity, as GitHub shows no more, the last with the number left."""
    lines = []
    for severity, command in COMMANDS.items():
        groups = [*(_unreadable(report) if severity is Severity.ERROR else ()), *_by_rule_and_file(report, severity)]
        shown = groups if len(groups) <= MAX_ANNOTATIONS else groups[: MAX_ANNOTATIONS - 1]
        for path, title, message in shown:
            lines.append(f"::{command} file={_property(path)},title={_property(title)}::{_data(message)}")
        if left := len(groups) - len(shown):
            lines.append(f"::{command} title=gltf-anim::{left} more of this severity, see the report of the step")
    lines.append(summary(report))
    return "\n".join(lines) + "\n"


def _unreadable(report: CheckReport) -> Iterator[tuple[str, str, str]]:
    """Path, title and message of unreadable files whose error is no finding, as a baseline knows it."""
    reported = {path for path, each in report.found if each.code == INVALID.code}
    for path, error in report.refused:
        if path not in reported:
            yield path, "unreadable", escape_control(str(error))


def _by_rule_and_file(report: CheckReport, severity: Severity) -> Iterator[tuple[str, str, str]]:
    """Path, title and message per rule and file."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for path, each in report.found:
        if each.severity is severity:
            groups.setdefault((path, each.code), []).append(each)
    for (path, code), found in groups.items():
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        message = f"{found[0].where}: {found[0].problem}{more}; {found[0].advice}"
        yield path, f"{code} {found[0].name}", escape_control(message)


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def as_sarif(report: CheckReport) -> str:
    """Return SARIF 2.1.0 that GitHub accepts: each result has a location with a region, though files are binary."""
    used = [rule for rule in RULES if any(each.code == rule.code for _, each in report.found)]
    index = {rule.code: i for i, rule in enumerate(used)}
    rules = [
        {
            "id": rule.code,
            "name": "".join(word.capitalize() for word in rule.name.split("-")),
            "shortDescription": {"text": rule.about},
            "fullDescription": {"text": rule.why},
            "help": {"text": f"gltf-anim check --explain {rule.code}"},
            "defaultConfiguration": {"level": LEVELS[rule.severity]},
        }
        for rule in used
    ]
    seen: Counter[str] = Counter()
    worst = sorted(report.found, key=lambda each: list(Severity).index(each[1].severity))[:MAX_RESULTS]
    results = [_result(path, each, index[each.code], seen) for path, each in worst]
    driver = {"name": "gltf-anim", "version": __version__, "informationUri": HOME, "rules": rules}
    notes: list[dict[str, Any]] = [
        {"level": "error", "message": {"text": f"{path}: {error}"}, "locations": [_location(path)]}
        for path, error in report.refused
    ]
    if left := len(report.found) - len(worst):
        notes.append({"level": "warning", "message": {"text": f"{left} more findings, of the least severe ones"}})
    run: dict[str, Any] = {"tool": {"driver": driver}, "columnKind": "utf16CodeUnits", "results": results}
    run["invocations"] = [{"executionSuccessful": not report.refused, "toolExecutionNotifications": notes}]
    content = {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}
    return json_report.dump(content)


def _result(path: str, found: Finding, rule: int, seen: Counter[str]) -> dict[str, Any]:
    key = fingerprint(path, found)
    seen[key] += 1
    location = _location(path)
    location["logicalLocations"] = [{"fullyQualifiedName": found.pointer or "/", "name": found.where}]
    return {
        "ruleId": found.code,
        "ruleIndex": rule,
        "level": LEVELS[found.severity],
        "message": {"text": f"{found.where}: {found.problem}. {found.advice}"},
        "locations": [location],
        "partialFingerprints": {"gltfAnim/v1": f"{key}:{seen[key]}"},
    }


def _location(path: str) -> dict[str, Any]:
    region = {"startLine": 1}
    return {
        "physicalLocation": {"artifactLocation": {"uri": quote(os.fsencode(path.replace("\\", "/")))}, "region": region}
    }


def as_junit(report: CheckReport) -> str:
    """Return JUnit XML: a test case per file, with findings that fail the check; others are its output."""
    refused = dict(report.refused)
    by_file: dict[str, list[Finding]] = {path: [] for path in report.files}
    for path, each in report.found:
        by_file[path].append(each)
    errors = {path: [each for each in found if report.is_failure(path, each)] for path, found in by_file.items()}
    failures = sum(bool(found) and path not in refused for path, found in errors.items())
    counts = {"tests": str(len(by_file)), "failures": str(failures), "errors": str(len(refused))}
    root = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(root, "testsuite", {"name": "gltf-anim check", **counts, "skipped": "0"})
    for path, found in by_file.items():
        case = ElementTree.SubElement(suite, "testcase", {"name": _xml(path), "classname": "gltf-anim"})
        if path in refused:
            outcome = ElementTree.SubElement(case, "error", {"message": _xml(str(refused[path]))})
            outcome.text = "\n".join(_xml(_line(each)) for each in errors[path])
        elif errors[path]:
            first = errors[path][0]
            about = {"message": _xml(_line(first)), "type": str(first.severity)}
            outcome = ElementTree.SubElement(case, "failure", about)
            outcome.text = "\n".join(_xml(_line(each)) for each in errors[path])
        if others := [each for each in found if not report.is_failure(path, each)]:
            ElementTree.SubElement(case, "system-out").text = "\n".join(_xml(_line(each)) for each in others)
    ElementTree.indent(root, " ")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _line(found: Finding) -> str:
    return f"{found.severity} {found.code} {found.name}: {found.where}: {found.problem}; {found.advice}"


def _xml(text: str) -> str:
    """Text without characters that XML 1.0 can't have, lone surrogates among them."""
    return escape_control(text).encode(errors="backslashreplace").decode()
