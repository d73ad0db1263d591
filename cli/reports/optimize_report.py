"""Text report of `optimize`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing.references import extensions_naming_keys
from anim.measure.inspect.storage_cost import animation_bytes
from anim.model import Clip
from anim.optimization.optimize import Optimized
from anim.optimization.options import Drop, Request
from anim.optimization.search.plan import Solution
from anim.optimization.verification import FLOAT_NOISE, Verification
from anim.optimization.writing import KEY
from anim.units import FEW, list_some, plural
from cli.errors import CheckError
from cli.reports import optimize_bound
from cli.reports.error_place import describe_place, describe_pointers
from cli.text import format_bytes, format_change, format_duration, format_fraction, format_length

NOTHING_MOVED = "no vertex moved"


@dataclass(frozen=True, slots=True)
class OptimizeReport:
    """Data of the report. size_before, size_after: bytes of the files; scale: m, the diagonal.

    measured_at: "surface" or, in a file without vertices, "nodes". max_bytes: the limit of the file, if there is one.
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
    max_bytes: int | None = None

    @property
    def unchanged(self) -> bool:
        """Return whether the output is the input."""
        return self.after is self.before

    @property
    def unchanged_because(self) -> str | None:
        """Reason for which the output is the input, None if it is not."""
        if not self.unchanged:
            return None
        if self.found.unchanged:
            return "optimized like this before"
        if not self.clips:
            return "it has no clips"
        if self.max_bytes is not None and self.size_before <= self.max_bytes:
            return "it fits --max-bytes as it is, without an error (--max-error alone gives the fewest bytes)"
        kept = retained_keys(self.before, self.found.solutions)
        return f"no smaller file within the bound{'; ' if kept else ''}{kept}"

    @property
    def optimized_before(self) -> bool:
        """Return whether the input has the marker of an earlier optimization."""
        extras = self.before.json["asset"].get("extras", {})
        return isinstance(extras, dict) and KEY in extras


def check(found: Optimized, clips: Sequence[Clip], request: Request, scale: float) -> None:
    """Raise CheckError if a clip exceeds its bounds."""
    bad = {i: each for i, each in found.verdicts.items() if not each.holds}
    if bad:
        worst = max(bad, key=lambda i: bad[i].usage)
        off = bad[worst].error
        raise CheckError(
            f"{reader.clip_label(clips[worst].name, worst)}: {_length(off.max_error, scale)} {describe_place(off)}, "
            f"{off.time:.3f} s (bound {format_length(request.bounds.max_error)}); nothing was written"
        )


def retained_keys(document: Document, clips: Iterable[int]) -> str:
    """Return the extensions that keep old keys of `clips` in the file, empty if none does."""
    places = extensions_naming_keys(document.json, clips)
    if not places:
        return ""
    return f"some old keys stay in the file, since unknown extensions may refer to them ({list_some(places, FEW)})"


def lines(about: OptimizeReport, *, dry_run: bool) -> list[str]:
    """Return the lines of the summary."""
    dry = " (dry run: nothing written)" if dry_run else ""
    if about.unchanged:
        said = f"{about.name}  {format_bytes(about.size_after)}, unchanged: {about.unchanged_because}{dry}"
        return [said]
    keys = f"{_keys(about.clips, about)} → {sum(count_keys(each.clip) for each in about.found.solutions.values())} keys"
    summary = [
        f"{about.name}  {format_change(about.size_before, about.size_after)}",
        f"animation {format_change(animation_bytes(about.before), animation_bytes(about.after))}",
        keys,
        _worst_words(about),
        format_duration(about.seconds),
    ]
    kept = retained_keys(about.before, about.found.solutions)
    return [", ".join(summary) + dry, *_goal(about), *_policy(about), *([f"note: {kept}"] if kept else [])]


def warnings(about: OptimizeReport) -> list[str]:
    """Return the warnings, shown even with -q, since they change the meaning of the figures."""
    return [] if about.found.unchanged else _earlier(about)


def details(about: OptimizeReport) -> list[str]:
    """Return a line per clip."""
    found = {} if about.unchanged else about.found.solutions
    return [_clip_line(about, i, solution) for i, solution in found.items()]


def _clip_line(about: OptimizeReport, number: int, solution: Solution) -> str:
    source = about.clips[number]
    keys = f"{count_keys(source)} → {count_keys(solution.clip)} keys"
    counts = f"{keys}, {len(source.tracks)} → {len(solution.clip.tracks)} tracks"
    found = about.found.verdicts[number]
    assert found.statistics is not None  # -v asks for them
    usual = f", p99 {format_length(found.statistics.p99)}, mean {format_length(found.statistics.mean)}"
    usual = optimize_bound.of_clip(found, about.request) + usual
    moved = found.error.max_error > FLOAT_NOISE * about.scale
    return f"  {reader.clip_label(source.name, number)}: {counts}, {_error_words(found, about)}{usual if moved else ''}"


def _keys(clips: Sequence[Clip], about: OptimizeReport) -> int:
    return sum(count_keys(clips[i]) for i in about.found.solutions)


def count_keys(clip: Clip) -> int:
    """Return the keys of all tracks."""
    return sum(len(track.times) for track in clip.tracks)


def _length(meters: float, scale: float) -> str:
    return f"max {format_length(meters)}{format_fraction(meters, scale)}"


def _worst_words(about: OptimizeReport) -> str:
    verdicts = about.found.verdicts
    if not verdicts:
        return "no clip"
    number = max(verdicts, key=lambda i: verdicts[i].error.max_error)
    clip = f" in {reader.quote_clip(about.clips[number].name, number)}" if len(about.clips) > 1 else ""
    words = _error_words(verdicts[number], about, clip)
    return words + optimize_bound.summary(verdicts.values(), about.request, about.scale)


def largest_error(about: OptimizeReport) -> str:
    """Return the largest error of all clips without its place, "" without changed clips."""
    found = [each.error for each in about.found.verdicts.values()]
    if not found or about.unchanged:
        return ""
    length = max(each.max_error for each in found)
    words = _length(length, about.scale) if length > FLOAT_NOISE * about.scale else NOTHING_MOVED
    return words + describe_pointers(max(found, key=lambda each: each.max_pointer_error))


def _error_words(verdict: Verification, about: OptimizeReport, clip: str = "") -> str:
    """Largest error of a clip, and its position. clip: " in 'Run'", where the line is about several."""
    error = verdict.error
    if error.max_error <= FLOAT_NOISE * about.scale:
        words = NOTHING_MOVED
    else:
        where = f"{clip} {describe_place(error)}, {error.time:.3f} s" if error.joint else clip
        words = _length(error.max_error, about.scale) + where
    return words + describe_pointers(error)


def _earlier(about: OptimizeReport) -> list[str]:
    """Note on an input that was optimized before: errors add up, as the file lacks the original motion."""
    if not about.optimized_before:
        return []
    return ["the input was optimized before; errors are measured from it, not from its source"]


def _goal(about: OptimizeReport) -> list[str]:
    """Line on a limit of bytes, which is no search for the fewest bytes."""
    if about.max_bytes is None:
        return []
    limit = f"--max-bytes {format_bytes(about.max_bytes)}"
    return [f"  the smallest error found that fits {limit}; --max-error alone gives the fewest bytes"]


def _policy(about: OptimizeReport) -> list[str]:
    """Lines on removed channels and moved vertices, with the rule applied."""
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
        names = [reader.clip_name(about.clips[i].name, i) for i in about.found.without_loss]
        words.append(f"kept without loss, as no smaller way held all bounds: {list_some(names)}")
    return [f"  {'; '.join(words)}"] if words else []
