"""Types of the data that `inspect` reports."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from anim.measure.inspect.report import Facts

if TYPE_CHECKING:
    from anim.measure.continuity.continuity import TrackContinuity

Inspected: TypeAlias = tuple[str, int, Facts]  # name, size in bytes, contents
Smoothness: TypeAlias = "tuple[tuple[TrackContinuity, ...], ...]"  # per clip and track
