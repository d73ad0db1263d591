"""Baseline: known findings, so that only new ones count."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

from anim.check.finding import Finding
from anim.errors import FormatError

SCHEMA = 1
MAX_PATH_LENGTH = 4096  # characters; parts of a file have names of any length
FileFinding = tuple[str, Finding]  # path of the file (with "/"), finding


def fingerprint(path: str, finding: Finding) -> str:
    """Return the key of a finding: rule, file and part, without numbers that change with the content."""
    return f"{finding.code}:{path}:{finding.where}"


def dump(found: Iterable[FileFinding], rename: Callable[[str], str] = str, kept: Counter[str] | None = None) -> str:
    """Return the JSON of a baseline, sorted, so that versions of it can be compared line by line.

    rename: gives the path of a file that the baseline names. kept: counts of an older baseline, by fingerprint.
    """
    counts = Counter(fingerprint(rename(path), each) for path, each in found) + (kept or Counter())
    return json.dumps({"schema": SCHEMA, "findings": dict(sorted(counts.items()))}, indent=1, ensure_ascii=False) + "\n"


def load(text: str) -> Counter[str]:
    """Return the counts by fingerprint. Raises FormatError if the text is no baseline."""
    try:
        content = json.loads(text.removeprefix("\ufeff"))
    except (ValueError, RecursionError):
        content = None
    findings = content.get("findings") if isinstance(content, dict) else None
    if not isinstance(findings, dict) or content.get("schema") != SCHEMA:
        raise FormatError("is no baseline (expected JSON of --write-baseline)")
    if not all(isinstance(count, int) and count > 0 for count in findings.values()):
        raise FormatError("has a count that is no whole number above 0")
    return Counter(findings)


def unchecked(known: Counter[str], checked: Collection[str], exists: Callable[[str], bool]) -> Counter[str]:
    """Return the known counts of files that exist and were not checked. checked: their paths in the baseline."""
    return Counter({key: count for key, count in known.items() if _is_unchecked(key, checked, exists)})


def _is_unchecked(key: str, checked: Collection[str], exists: Callable[[str], bool]) -> bool:
    paths = list(_paths(key))
    return not any(path in checked for path in paths) and any(map(exists, paths))


def _paths(key: str) -> Iterator[str]:
    """Possible paths in a fingerprint: paths and names of parts may contain ":" too."""
    rest = key.partition(":")[2][: MAX_PATH_LENGTH + 1]
    return (rest[:i] for i, character in enumerate(rest) if character == ":")


def split(
    found: Sequence[FileFinding], known: Counter[str], rename: Callable[[str], str] = str
) -> tuple[list[FileFinding], Counter[str]]:
    """Return the findings that are not known, and the known ones that are gone, with their counts."""
    left = known.copy()
    new = []
    for each in found:
        key = fingerprint(rename(each[0]), each[1])
        if left[key] > 0:
            left[key] -= 1
        else:
            new.append(each)
    return new, +left
