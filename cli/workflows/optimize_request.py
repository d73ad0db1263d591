"""Options of `optimize` converted into a request in metres and radians."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from anim.measure.error.surface import diagonal
from anim.model import Scene
from anim.operations.selection import Selection
from anim.optimization.options import Bounds
from anim.units import is_zero
from cli import units
from cli.errors import UsageError

MAX_ERROR = "0.01%"  # of the diagonal
BYTES = {"": 1, "b": 1, "kb": 1000, "mb": 1_000_000, "gb": 10**9, "kib": 1024, "mib": 1 << 20, "gib": 1 << 30}


def bounds(scene: Scene, said: Mapping[str, str | None]) -> Bounds:
    """Return the bounds in metres and radians; percents are of the scene's diagonal. Raises UsageError.

    said: option texts by the names of the bounds; None for options not given.
    """
    scale = diagonal(scene)

    def length(name: str) -> float | None:
        text, option = said[name], f"--{name.replace('_', '-')}"
        if text is None:
            return None
        return 0.0 if is_zero(text) else units.parse_length(text, option, lambda: scale)

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


def notes(said: Mapping[str, str | None]) -> Iterator[str]:
    """Yield notes on lengths without a unit, which are metres."""
    for name in ("max_error", "shell"):
        text = (said[name] or "").strip()
        if text and text[-1].isdigit() and not is_zero(text):
            yield f"--{name.replace('_', '-')} {text} means {text} m, for want of a unit (0.5mm, 0.1%)"


def _fraction(text: str | None) -> str:
    number = (text or "").strip()
    return f"{float(number[:-1])}%" if number.endswith("%") else ""


def nodes_to_keep(globs: Sequence[str], scene: Scene) -> frozenset[int]:
    """Return the indices of the nodes that match any glob; none without globs. Raises NotFoundError."""
    return frozenset(Selection((), globs).chosen_nodes(scene.skeleton)) if globs else frozenset()


def count_of_bytes(text: str) -> int:
    """Return a number of bytes above 0: 800kB, 1.5 MB, 65536. Raises UsageError."""
    number = text.strip().lower().rstrip("bkmgi ")
    unit = text.strip().lower()[len(number) :].strip()
    try:
        count = int(float(number) * BYTES[unit])
    except (ValueError, KeyError, OverflowError):
        count = 0
    if count <= 0:
        raise UsageError(f"--max-bytes is '{text}' (expected a size like 800kB, 1.5MB or 65536)")
    return count
