"""Selection of the frames of a picture: given times, a number of even ones, or a rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.caches.transforms.resample import SAME_FRAME_TOLERANCE_S
from anim.errors import RangeError
from anim.sampling import frame_times
from anim.sampling.times import too_many_frames

MAX_FRAMES = 3000
FEWER_PICTURES = "choose a lower `fps`, or `count` instead, or a part by `begin` and `end`"


@dataclass(frozen=True, slots=True)
class FrameSelection:
    """Selection of frames: given times, `count` even ones, or `fps` per second, from `begin` to `end` s.

    begin, end: None for the clip's own.
    """

    at: tuple[float, ...] = ()
    count: int | None = None
    fps: float | None = None
    begin: float | None = None
    end: float | None = None

    def check(self, start: float, end: float) -> None:
        """Raise RangeError for a requested time outside all motions, which range from `start` to `end` s."""
        for time in self.at:
            if not start - SAME_FRAME_TOLERANCE_S <= time <= end + SAME_FRAME_TOLERANCE_S:
                raise RangeError(f"there is no frame at {time:g} s (the motion goes from {start:g} s to {end:g} s)")

    def span(self, start: float, end: float) -> tuple[float, float]:
        """Return the first and last time in s of a motion from `start` to `end`. Raises RangeError for none."""
        first = start if self.begin is None else max(self.begin, start)
        last = end if self.end is None else min(self.end, end)
        if first > last:
            raise RangeError(
                f"nothing lies from {first:g} s to {last:g} s (the motion goes from {start:g} s to {end:g} s)"
            )
        return first, last

    def times(self, start: float, end: float) -> Floats:
        """Return times (F,) s of a motion from `start` to `end`; of those in `at` only those within.

        Raises RangeError if the selection is empty otherwise, UnsupportedError for more than MAX_FRAMES frames.
        """
        if self.at:
            at = np.unique(np.array(self.at, np.float64))
            return at[(at >= start - SAME_FRAME_TOLERANCE_S) & (at <= end + SAME_FRAME_TOLERANCE_S)]
        first, last = self.span(start, end)
        if self.fps is not None and self.count is None:
            found = frame_times(first, last, fps=self.fps, help=FEWER_PICTURES)
            if len(found) > MAX_FRAMES:
                raise too_many_frames(len(found), self.fps, limit=MAX_FRAMES, help=FEWER_PICTURES)
            return found
        return np.linspace(first, last, self.count or 1) if last > first else np.array([first])
