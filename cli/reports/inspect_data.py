"""What `inspect` knows of a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from anim.measure.inspect.report import Facts

if TYPE_CHECKING:
    from anim.measure.continuity.continuity import TrackContinuity

Inspected: TypeAlias = tuple[str, int, Facts]  # its name, its bytes, and what is in it
Smoothness: TypeAlias = "tuple[tuple[TrackContinuity, ...], ...]"  # of each clip, of each of its tracks
