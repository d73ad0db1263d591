"""Reports as panels of a page: findings with links, contents, and sizes."""

from __future__ import annotations

import re

from anim.check.finding import Finding, Severity
from anim.show.page.page import PageLink, PagePanel, PageRow
from anim.units import plural
from cli.reports.inspect_report import Inspected
from cli.reports.optimize_report import OptimizeReport, cost
from cli.text import format_bytes, format_change

_CLIP = re.compile(r"/animations/(\d+)")
_NODE = re.compile(r"/nodes/(\d+)")


def report_panels(inspected: Inspected) -> list[PagePanel]:
    """Return the findings of a file, most severe first, and its contents."""
    order = list(Severity)
    findings = sorted(inspected.findings, key=lambda each: order.index(each.severity))
    rows = tuple(_finding_row(each) for each in findings) or (PageRow(("none",)),)
    facts = inspected.facts
    contents = [
        ("animations", format_bytes(facts.animation_stored_bytes + facts.animation_json_bytes)),
        ("nodes", str(facts.nodes)),
        ("meshes", str(facts.meshes)),
        *((("vertices", str(facts.vertices)),) if facts.vertices is not None else ()),
        *((f"skin {i}", plural(skin.joints, "joint")) for i, skin in enumerate(facts.skins)),
        *((("made by", facts.generator),) if facts.generator else ()),
    ]
    return [
        PagePanel("Findings", rows, str(len(findings) or "")),
        PagePanel("Contents", tuple(map(PageRow, contents))),
    ]


def size_panels(about: OptimizeReport) -> list[PagePanel]:
    """Return the sizes before and after an optimization."""
    before, after = cost(about.before), cost(about.after)
    rows = (
        PageRow(("file", format_change(about.size_before, about.size_after))),
        PageRow(("animation", format_change(before, after))),
    )
    return [PagePanel("Size", rows)]


def _finding_row(finding: Finding) -> PageRow:
    words = f"{finding.where}: {finding.problem}" if finding.where else finding.problem
    level = finding.severity.value if finding.severity is not Severity.INFO else ""
    return PageRow((f"{finding.code} {words}",), _link(finding), level)


def _link(finding: Finding) -> PageLink | None:
    clip, node = (_index(pattern, finding.pointer) for pattern in (_CLIP, _NODE))
    if clip is None and node is None and finding.time_s is None:
        return None
    return PageLink(clip, node, finding.time_s)


def _index(pattern: re.Pattern[str], pointer: str) -> int | None:
    found = pattern.match(pointer)
    return None if found is None else int(found[1])
