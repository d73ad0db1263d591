"""What `optimize` says of its work: a line or two for a person, every figure for a script."""

from __future__ import annotations

import csv
import io
import json as jsonlib
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from anim.gltf import read
from anim.gltf.document import Document
from anim.measure.footprint import footprints
from anim.measure.stored import stored
from anim.model import Clip
from anim.optimize.limits import Drop
from anim.optimize.optimize import Optimized
from anim.optimize.request import Request
from anim.optimize.seal import KEY
from anim.optimize.solution import Solution
from anim.optimize.tradeoff import Sized
from anim.optimize.verify import NOTHING, Verdict
from cli import optimize_proof
from cli.errors import CheckError
from cli.report import change, length, plural, share, size, took

SCHEMA = 1
LONG = 60_000  # keys times tracks; above, fresh processes are worth their start


@dataclass(frozen=True, slots=True)
class About:
    """Everything there is to say. size_before, size_after: bytes of the files; scale: m, the diagonal.

    measured_at: "surface" or, in a file without vertices, "nodes".
    """

    name: str
    before: Document
    after: Document
    clips: Sequence[Clip]
    found: Optimized
    request: Request
    scale: float
    size_before: int
    size_after: int
    seconds: float
    measured_at: str

    @property
    def unchanged(self) -> bool:
        """Whether the input was given back."""
        return self.after is self.before


def is_long(clips: Sequence[Clip], chosen: Sequence[int]) -> bool:
    """Return whether the work takes so long that several processes are faster than one."""
    return len(chosen) > 1 and sum(track.values.size for i in chosen for track in clips[i].tracks) > LONG


def check(found: Optimized, clips: Sequence[Clip], request: Request, scale: float) -> None:
    """Raise CheckError where a clip does not keep its bounds."""
    bad = {i: each for i, each in found.verdicts.items() if not each.holds}
    if bad:
        worst = max(bad, key=lambda i: bad[i].strain)
        off = bad[worst].error
        raise CheckError(
            f"{read.label(clips[worst].name, worst)}: {_length(off.max_error, scale)} at '{off.joint}', "
            f"{off.time:.3f} s (bound {length(request.bounds.max_error)}); nothing was written"
        )


def smaller(found: Optimized, document: Document, size_of: Callable[[Document], int]) -> Document:
    """Return the optimized document, or the old one where it takes no more bytes."""
    if found.unchanged or size_of(found.document) >= size_of(document):
        return document
    return found.document


def worst(found: Optimized) -> float:
    """Return the largest error of any clip, in metres."""
    return max((each.error.max_error for each in found.verdicts.values()), default=0.0)


def lines(about: About, *, dry_run: bool) -> list[str]:
    """Return what is always said."""
    dry = " (dry run: nothing written)" if dry_run else ""
    if about.unchanged:
        said = f"{about.name}  {size(about.size_after)}, unchanged: {_why_unchanged(about)}{dry}"
        return [said]
    keys = f"{_keys(about.clips, about)} → {sum(_count(each.clip) for each in about.found.solutions.values())} keys"
    summary = [
        f"{about.name}  {change(about.size_before, about.size_after)}",
        f"animation {change(cost(about.before), cost(about.after))}",
        keys,
        _worst_words(about),
        took(about.seconds),
    ]
    return [", ".join(summary) + dry, *_policy(about)]


def warnings(about: About) -> list[str]:
    """Return what is said even when quiet, since it changes what the numbers mean."""
    return [] if about.found.unchanged else _earlier(about)


def details(about: About) -> list[str]:
    """Return a line per clip."""
    found = {} if about.unchanged else about.found.solutions
    return [_clip_line(about, i, solution) for i, solution in found.items()]


def _clip_line(about: About, number: int, solution: Solution) -> str:
    source = about.clips[number]
    counts = (
        f"{_count(source)} → {_count(solution.clip)} keys, {len(source.tracks)} → {len(solution.clip.tracks)} tracks"
    )
    found = about.found.verdicts[number]
    assert found.statistics is not None  # -v asks for them
    usual = f", p99 {length(found.statistics.p99)}, mean {length(found.statistics.mean)}"
    usual = optimize_proof.of_clip(found, about.request) + usual
    moved = found.error.max_error > NOTHING * about.scale
    return f"  {read.label(source.name, number)}: {counts}, {_error_words(found, about)}{usual if moved else ''}"


def _why_unchanged(about: About) -> str | None:
    """Why the output is the input, None where it is not."""
    if not about.unchanged:
        return None
    return "optimized like this before" if about.found.unchanged else "no smaller file within the bound"


def as_json(about: About, *, warnings: Sequence[str] = ()) -> str:
    """Return the report as a JSON document, schema 1. warnings: said so far."""
    request = about.request
    content = {
        "schema": SCHEMA,
        "output": about.name,
        "unchanged": about.unchanged,
        "unchanged_because": _why_unchanged(about),
        "seconds": round(about.seconds, 3),
        "diagonal_m": about.scale,
        "measured_at": about.measured_at,
        "optimized_before": _is_marked(about.before),
        "bounds": {
            "max_error_m": request.bounds.max_error,
            "shell_m": request.bounds.shell,
            "max_pointer_error": request.bounds.max_pointer_error,
            "max_angle_deg": None if request.bounds.max_angle is None else math.degrees(request.bounds.max_angle),
            "max_speed_error_m_per_s": request.bounds.max_speed_error,
        },
        "policy": {
            "drop": str(request.policy.drop),
            "reference": str(request.policy.reference),
            "rebase_rest": request.policy.rebase_rest,
            "drop_invisible": request.policy.drop_invisible,
            "kept_nodes": sorted(request.policy.keep),
            "packing": str(request.packing),
            "objective": str(request.objective),
            "effort": request.effort,
            "players": list(request.players),
        },
        "bytes": {
            "before": _bytes(about.size_before, about.before),
            "after": _bytes(about.size_after, about.after),
        },
        "moved_rest": [_target(about, node, path) for node, path in about.found.moved],
        "clips": [] if about.unchanged else [_clip(about, i, each) for i, each in about.found.solutions.items()],
        "warnings": list(warnings),
    }
    return jsonlib.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def curve_line(sized: Sized, scale: float) -> str:
    """Return one point of the curve for a person."""
    percent = 100 * sized.max_error / scale if scale else 0.0
    bound = f"{length(sized.max_error)} ({percent:.2g} %)" if sized.max_error else "without loss"
    return f"  {bound}: animation {size(sized.animation)}, file {size(sized.size)}, max {length(sized.error)}"


def curve_csv(sizes: Sequence[Sized], scale: float) -> str:
    """Return the curve as CSV: bound in metres and as a share of the diagonal, bytes of the file, largest error found,
    and bytes of the animation alone."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["max_error_m", "share_of_diagonal", "bytes", "error_m", "animation_bytes"])
    for each in sizes:
        share = each.max_error / scale if scale else 0.0
        writer.writerow([each.max_error, share, each.size, each.error, each.animation])
    return text.getvalue()


def cost(document: Document) -> int:
    """Return the bytes of all animations: keys as stored, and JSON."""
    return stored(document) + footprints(document)[1].json


def _keys(clips: Sequence[Clip], about: About) -> int:
    return sum(_count(clips[i]) for i in about.found.solutions)


def _count(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def _length(meters: float, scale: float) -> str:
    return f"max {length(meters)}{share(meters, scale)}"


def _worst_words(about: About) -> str:
    verdicts = about.found.verdicts
    if not verdicts:
        return "no clip"
    words = _error_words(max(verdicts.values(), key=lambda each: each.error.max_error), about)
    return words + optimize_proof.summary(verdicts.values(), about.request, about.scale)


def _error_words(verdict: Verdict, about: About) -> str:
    error = verdict.error
    if error.max_error <= NOTHING * about.scale:
        words = "no vertex moved"
    else:
        where = f" at '{error.joint}', {error.time:.3f} s" if error.joint else ""
        words = _length(error.max_error, about.scale) + where
    if error.max_pointer_error > 0:
        words += f", pointers max {100 * error.max_pointer_error:.2g} % of range at {error.pointer}"
    return words


def _earlier(about: About) -> list[str]:
    """What to know where the input was lossy before: nothing in a file tells its motion from its own source's."""
    if not _is_marked(about.before):
        return []
    return ["the input was optimized before; errors are measured from it, not from its source"]


def _is_marked(document: Document) -> bool:
    extras = document.json["asset"].get("extras", {})
    return isinstance(extras, dict) and KEY in extras


def _policy(about: About) -> list[str]:
    """What was removed and moved, and under which rule."""
    policy, words = about.request.policy, []
    dropped = Counter(about.clips[i].tracks[k].path for i, each in about.found.solutions.items() for k in each.dropped)
    if dropped:
        rule = {Drop.REST: "at rest", Drop.UNUSED: "at rest in all clips", Drop.NEVER: "unseen"}[policy.drop]
        seen = f"{rule} or unseen" if policy.drop_invisible and policy.drop is not Drop.NEVER else rule
        each = ", ".join(f"{count} {path}" for path, count in sorted(dropped.items()))
        words.append(f"dropped {plural(dropped.total(), 'channel')} {seen} ({each}; --drop {policy.drop})")
    if about.found.moved:
        words.append(f"moved {plural(len(about.found.moved), 'rest value')}")
    if about.found.without_loss:
        names = [read.clip_name(about.clips[i].name, i) for i in about.found.without_loss]
        words.append(f"kept without loss, as no smaller way held all bounds: {', '.join(names)}")
    return [f"  {'; '.join(words)}"] if words else []


def _bytes(file: int, document: Document) -> dict[str, int]:
    whole = footprints(document)[1]
    return {"file": file, "data": whole.data, "stored": stored(document), "json": whole.json}


def _target(about: About, node: int | None, path: str, pointer: str | None = None) -> dict[str, Any]:
    if node is None:
        return {"pointer": pointer, "path": path}
    names = read.skeleton(about.before).names
    return {"node": node, "name": names[node] if node < len(names) else "", "path": path}


def _clip(about: About, number: int, solution: Solution) -> dict[str, Any]:
    source, verdict = about.clips[number], about.found.verdicts[number]
    error, rest = verdict.error, verdict.statistics
    assert rest is not None  # a report asks for details
    return {
        "number": number,
        "name": source.name,
        "end_s": source.end,
        "keys_before": _count(source),
        "keys_after": _count(solution.clip),
        "tracks_before": len(source.tracks),
        "tracks_after": len(solution.clip.tracks),
        "max_error_m": error.max_error,
        "max_error_percent": 100 * error.max_error / about.scale if about.scale else 0.0,
        "at": {
            "mesh": error.place,
            "joint": error.joint,
            "vertex": error.vertex,
            "time_s": error.time,
            "player": verdict.player,
        },
        "certified_error_m": verdict.certified,
        "not_certified_because": optimize_proof.why_not(verdict, about.request),
        "p99_m": rest.p99,
        "mean_m": rest.mean,
        "max_angle_deg": math.degrees(rest.angle.size),
        "max_speed_error_m_per_s": rest.speed.size,
        "max_weight_error": rest.weight.size,
        "max_pointer_error": error.max_pointer_error,
        "times_checked": error.times,
        "without_loss": number in about.found.without_loss,
        "dropped": [
            _target(about, track.node, track.path, track.pointer)
            for track in (source.tracks[k] for k in solution.dropped)
        ],
    }
