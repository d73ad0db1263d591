"""What `optimize` is asked for: its options, as they were typed, turned into one request in metres and radians."""

from __future__ import annotations

import re
from collections.abc import Sequence

from anim.measure.surface import diagonal
from anim.model import Scene
from anim.ops.selection import Selection
from anim.optimize.limits import Bounds
from cli import units
from cli.errors import UsageError

MAX_ERROR = "0.01%"  # of the diagonal, where nothing else is said
ZERO = re.compile(r"\s*0+(\.0*)?\s*(%|m|cm|mm|um|µm)?\s*")
BYTES = {"": 1, "b": 1, "kb": 1000, "mb": 1_000_000, "gb": 10**9, "kib": 1024, "mib": 1 << 20, "gib": 1 << 30}


def bounds(
    scene: Scene,
    *,
    max_error: str | None,
    shell: str,
    max_pointer_error: str,
    max_angle: str | None,
    max_speed_error: str | None,
) -> Bounds:
    """Return the bounds in metres and radians; percents are of the scene's diagonal. Raises UsageError."""
    scale = diagonal(scene)
    return Bounds(
        _length(MAX_ERROR if max_error is None else max_error, "--max-error", scale),
        _length(shell, "--shell", scale),
        0.0 if ZERO.fullmatch(max_pointer_error) else units.share(max_pointer_error, "--max-pointer-error"),
        None if max_angle is None else units.angle(max_angle, "--max-angle"),
        None if max_speed_error is None else units.meters(max_speed_error, "--max-speed-error", lambda: scale),
    )


def kept(globs: Sequence[str], scene: Scene) -> frozenset[int]:
    """Return the numbers of the nodes that match any glob; none without globs. Raises NotFoundError."""
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


def _length(text: str, option: str, scale: float) -> float:
    """Metres, 0 allowed."""
    return 0.0 if ZERO.fullmatch(text) else units.meters(text, option, lambda: scale)
