"""Reports as panels of a page: findings with links, contents, sizes, and figures of clips."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import PurePath

from anim.check.finding import Finding, Occurrence, Severity
from anim.gltf.document import Document
from anim.measure.inspect.report import ClipReport, Facts, SkinReport
from anim.measure.inspect.storage_cost import animation_bytes
from anim.show.page.page import ClipFigure, PageLink, PagePanel, PageRow
from anim.units import format_number, plural
from cli.reports.inspect_report import MIN_ROOT_DISTANCE_M, PATHS, Inspected, frame_rate
from cli.reports.optimize_report import OptimizeReport
from cli.text import format_bytes, format_change, format_length, format_speed

NEW_SUFFIX = "-new"  # of the file that advised commands write
_IN_OUT = re.compile(r"(gltf-anim \S+) IN OUT\b")
_CLIP = re.compile(r"/animations/(\d+)")
_NODE = re.compile(r"/nodes/(\d+)")
_SKIN = re.compile(r"/skins/(\d+)")
HEALTHY = PageRow(("healthy: nothing found",))


def report_panels(inspected: Inspected, document: Document) -> list[PagePanel]:
    """Return the findings of a file, most severe first, its skins and its contents."""
    order = list(Severity)
    groups = sorted(
        zip(inspected.findings, inspected.occurrences, strict=True), key=lambda each: order.index(each[0].severity)
    )
    rows = tuple(_finding_row(*each, document, inspected.name) for each in groups) or (HEALTHY,)
    facts = inspected.facts
    skins = tuple(map(_skin_row, facts.skins))
    return [
        PagePanel("Findings", rows, str(len(groups) or "")),
        *([PagePanel("Skins", skins)] if skins else []),
        PagePanel("Contents", tuple(map(PageRow, _contents(inspected.file_bytes, facts)))),
    ]


def clip_figures(facts: Facts) -> dict[int, list[ClipFigure]]:
    """Return the columns of `inspect` by clip; cells that are empty there are left out."""
    return {clip.index: _figures(clip) for clip in facts.clips}


def _figures(clip: ClipReport) -> list[ClipFigure]:
    size = clip.stored_bytes + clip.json_bytes
    on = "" if clip.seam_measured_on == "skin" else " (nodes)"
    figures = [ClipFigure("fps", frame_rate(clip), clip.frame_rate_fps or 0.0)] if frame_rate(clip) else []
    figures += [
        ClipFigure("keys", str(clip.keys), clip.keys),
        ClipFigure(f"loop gap{on}", format_length(clip.seam_m), clip.seam_m),
        ClipFigure("velocity gap", format_speed(clip.seam_speed_m_per_s), clip.seam_speed_m_per_s),
    ]
    if clip.root_distance_m > MIN_ROOT_DISTANCE_M:
        figures.append(ClipFigure("root speed", format_speed(clip.root_speed_m_per_s), clip.root_speed_m_per_s))
    figures += [ClipFigure(path, plural(n, "track"), n) for path in PATHS if (n := clip.tracks.get(path, 0))]
    figures += [ClipFigure(name.lower(), plural(n, "track"), n) for name, n in sorted(clip.interpolations.items())]
    waste = {"constant": clip.constant_tracks, "no-op": clip.no_effect_tracks}
    figures += [ClipFigure(name, plural(n, "track"), n) for name, n in waste.items() if n]
    if clip.redundant_keys:
        figures.append(ClipFigure("redundant", plural(clip.redundant_keys, "key"), clip.redundant_keys))
    return [*figures, ClipFigure("size", f"{format_bytes(size)}, {format_number(100 * clip.share, 2)} %", size)]


def _skin_row(skin: SkinReport) -> PageRow:
    parts = [plural(skin.joints, "joint")]
    parts += [f"{skin.unused_joints} unused"] if skin.unused_joints else []
    parts += [plural(skin.vertices, "vertex", "vertices")] if skin.vertices else []
    if skin.mean_influences is not None:
        parts.append(f"{skin.mean_influences:.2f} influences on average, {skin.most_influences} at most")
    parts += [f"{skin.off_sums} weight sums ≠ 1"] if skin.off_sums else []
    return PageRow((skin.name or f"#{skin.index}",), text=", ".join(parts))


def _contents(file_bytes: int, facts: Facts) -> list[tuple[str, str]]:
    cost = facts.animation_stored_bytes + facts.animation_json_bytes
    part = f", {100 * cost / file_bytes:.0f} %" if file_bytes else ""
    return [
        ("file", format_bytes(file_bytes)),
        ("animation", format_bytes(cost) + part),
        ("keys", format_bytes(facts.animation_stored_bytes)),
        ("JSON of animations", format_bytes(facts.animation_json_bytes)),
        ("nodes", str(facts.nodes)),
        ("meshes", str(facts.meshes)),
        *((("vertices", str(facts.vertices)),) if facts.vertices is not None else ()),
        *((("extensions", ", ".join(facts.extensions_used)),) if facts.extensions_used else ()),
        *((("made by", facts.generator),) if facts.generator else ()),
    ]


def size_panels(about: OptimizeReport) -> list[PagePanel]:
    """Return the sizes before and after an optimization."""
    before, after = animation_bytes(about.before), animation_bytes(about.after)
    rows = (
        PageRow(("file", format_change(about.size_before, about.size_after))),
        PageRow(("animation", format_change(before, after))),
    )
    return [PagePanel("Size", rows)]


def _finding_row(finding: Finding, found: Sequence[Occurrence], document: Document, name: str) -> PageRow:
    words = f"{finding.where}: {finding.problem}" if finding.where else finding.problem
    cells = (finding.name, finding.code)
    links = [(each.label, _link(each, document)) for each in found]
    parts = tuple((label, link) for label, link in links if link is not None) if len(found) > 1 else ()
    advice = advice_for(name, finding.advice)
    link = _link(found[0] if found else finding, document)
    return PageRow(cells, link, finding.severity.value, words, advice, parts)


def advice_for(file: str, advice: str) -> str:
    """Return advice with the names of a file and of a new one beside it instead of IN and OUT.

    advice_for("walk.glb", "gltf-anim trim IN OUT --rebase") → "gltf-anim trim walk.glb walk-new.glb --rebase"
    """
    name = PurePath(PurePath(file).name)
    folder = "./" if str(name).startswith("-") else ""  # not an option
    names = shlex.join([f"{folder}{name}", f"{folder}{name.stem}{NEW_SUFFIX}{name.suffix}"])
    return _IN_OUT.sub(lambda found: f"{found[1]} {names}", advice, count=1)


def _link(found: Finding | Occurrence, document: Document) -> PageLink | None:
    """Clip, node and time that a finding or a part of it is about; for a skin, its first joint."""
    clip, node, skin = (_index(pattern, found.pointer) for pattern in (_CLIP, _NODE, _SKIN))
    if skin is not None:
        node = document.json["skins"][skin]["joints"][0]
    if isinstance(found, Occurrence) and found.node is not None:
        node = found.node
    if clip is None and node is None and found.time_s is None:
        return None
    return PageLink(clip, node, found.time_s)


def _index(pattern: re.Pattern[str], pointer: str) -> int | None:
    found = pattern.match(pointer)
    return None if found is None else int(found[1])
