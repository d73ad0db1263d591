"""Optimization of one file, as its options ask for."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from anim.files import signals
from anim.gltf.document import Document
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.node_constraints import rest_pose_extensions
from anim.measure.error.surface import diagonal, reference_length
from anim.model import Scene
from anim.operations.selection import Selection
from anim.optimization.byte_limit import ByteLimit, ByteLimitError
from anim.optimization.file_optimizer import FileOptimizer
from anim.optimization.optimize import Optimized
from anim.optimization.options import Bounds, Request
from anim.units import format_number, is_zero, plural
from cli import units
from cli.errors import CheckError
from cli.io import documents, scenes
from cli.progress import Progress
from cli.reports import optimize_report
from cli.streams import step_streams
from cli.text import Reporter, format_length

START = "fork" if sys.platform == "linux" else "spawn"  # start method of worker processes


def make_optimizer(
    source: Source, output: str, *, clip: Sequence[str], workers: int, detailed: bool, reporter: Reporter
) -> FileOptimizer:
    """Return the optimizer of a source. clip: globs. workers: processes, 0 for one per core.

    Raises NotFoundError; FormatError or UnsupportedError if vertices can't be read, since no bound can be verified.
    """
    document = source.document
    accessors = Accessors(document)
    clips = tuple(reader.clips(document, accessors))
    scene = scenes.read_scene(document, source.name, reporter, accessors=accessors, repeats=False)
    shown = Progress("optimize", 1000, shown=not reporter.quiet)

    @contextmanager
    def show_progress() -> Iterator[Callable[[float], None]]:
        with signals.ignore_broken_pipes():
            yield lambda fraction: shown(round(1000 * fraction))
        shown.close()

    return FileOptimizer(
        document,
        scene,
        clips,
        chosen=Selection(clip).chosen_clips(reader.names(document)),
        scale=diagonal(scene),
        written_size=lambda new: documents.write(new, output, source, dry_run=True),
        workers=workers or _cores(),
        start=START,
        detailed=detailed,
        progress=show_progress,
    )


def note_rest_pose(document: Document, name: str, reporter: Reporter) -> None:
    """Say why the rest pose stays, if extensions depend on it."""
    if found := rest_pose_extensions(document.json):
        reporter.info(f"note: {name}: the rest pose stays, since {found[0]} depends on it")


def optimize_within(
    optimizer: FileOptimizer, request: Request, max_bytes: int | None, ceiling: float | None
) -> tuple[Request, Optimized]:
    """Return the result, with the request that it answers.

    max_bytes: of the file, else the bounds count. ceiling: m, the greatest allowed error, as of `ByteLimit`.
    Raises CheckError if nothing fits.
    """
    if max_bytes is None:
        return request, optimizer.run(request)
    try:
        return ByteLimit(optimizer, max_bytes, request, ceiling).run()
    except ByteLimitError as error:
        raise _refusal(optimizer, max_bytes, error) from None


def _refusal(optimizer: FileOptimizer, max_bytes: int, error: ByteLimitError) -> CheckError:
    """The error for a limit that nothing meets."""
    smallest, max_error = error.smallest, error.max_error
    if not optimizer.clips:
        return CheckError(
            f"doesn't fit {plural(max_bytes, 'byte')}: it takes {plural(smallest.size, 'byte')}, and has no clips that "
            "could take fewer; nothing was written"
        )
    share = 100 * max_error / optimizer.scale if optimizer.scale else math.inf
    percent = f" ({format_number(share, 2)} %)" if math.isfinite(share) else ""
    kept = optimize_report.retained_keys(optimizer.document, optimizer.chosen)
    return CheckError(
        f"doesn't fit {plural(max_bytes, 'byte')}: with an error of up to {format_length(max_error)}{percent} "
        f"it still takes {plural(smallest.size, 'byte')}, {smallest.animation} of them animation; "
        f"{kept}{'; ' if kept else ''}nothing was written",
        help=f"what fits, with your other options: gltf-anim optimize IN OUT --max-bytes {smallest.size}",
    )


def _cores() -> int:
    step = step_streams()
    return (0 if step is None else step.cores) or os.cpu_count() or 1


def bounds(scene: Scene, said: Mapping[str, str | None]) -> Bounds:
    """Return the bounds in metres and radians; percents are of the scene's diagonal. Raises UsageError.

    said: option texts by the names of the bounds; None for options not given.
    """
    scale = diagonal(scene)

    def length(name: str) -> float | None:
        text, option = said[name], f"--{name.replace('_', '-')}"
        if text is None:
            return None
        whole = reference_length(scale) if name == "shell" else scale
        return 0.0 if is_zero(text) else units.parse_length(text, option, lambda: whole)

    pointer, angle, speed = said["max_pointer_error"] or "0", said["max_angle"], said["max_speed_error"]
    return Bounds(
        length("max_error") or 0.0,
        length("shell") or 0.0,
        0.0 if is_zero(pointer) else units.parse_fraction(pointer, "--max-pointer-error"),
        None if angle is None else units.parse_angle(angle, "--max-angle"),
        None if speed is None else units.parse_length(speed, "--max-speed-error", lambda: scale),
    )


def raw_options(bounds: Bounds, said: Mapping[str, str | None]) -> tuple[str, ...]:
    """Return bounds as typed if they are fractions of the diagonal, else in metres."""
    return tuple(_fraction(text) or f"{getattr(bounds, name)}" for name, text in said.items())


def warn_without_units(said: Mapping[str, str | None], warn: Callable[[str], None]) -> None:
    """Warn of lengths without a unit, which are metres."""
    for name in ("max_error", "shell"):
        units.warn_without_unit(said[name], f"--{name.replace('_', '-')}", warn)


def _fraction(text: str | None) -> str:
    number = (text or "").strip()
    return f"{float(number[:-1])}%" if number.endswith("%") else ""


def nodes_to_keep(globs: Sequence[str], scene: Scene) -> frozenset[int]:
    """Return the indices of the nodes that match any glob; none without globs. Raises NotFoundError."""
    return frozenset(Selection((), globs).chosen_nodes(scene.skeleton)) if globs else frozenset()


def count_of_bytes(text: str) -> int:
    """Return a number of bytes above 0: 800kB, 1.5 MB, 65536. Raises UsageError."""
    return units.parse_size(text, "--max-bytes")
