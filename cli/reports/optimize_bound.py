"""Report of `optimize` on the error between sampled times: the proven bound, or the reason for none."""

from __future__ import annotations

import math
from collections.abc import Iterable

from anim.optimization.options import Reference, Request
from anim.optimization.verification import FLOAT_NOISE, Verification
from cli.text import format_length

NOT_PROVEN = "bound not proven between samples"


def summary(verdicts: Iterable[Verification], request: Request, scale: float) -> str:
    """Return the bound proven for all times of all clips; "" if no vertex moved or only keys count.

    scale: m, the diagonal.
    """
    moved = [each for each in verdicts if each.error.max_error > FLOAT_NOISE * scale]
    if not moved or request.policy.reference is Reference.KEYS:
        return ""
    proven = [each.certified for each in moved if each.certified is not None]
    if len(proven) < len(moved):
        return f", {NOT_PROVEN}"
    if max(proven) <= request.bounds.max_error:
        return ", bound holds at all times"
    return f", at all times at most {format_length(_rounded_up(max(proven)))}"


def of_clip(verdict: Verification, request: Request) -> str:
    """Return the bound of a clip for every time."""
    if request.policy.reference is Reference.KEYS:
        return ""
    if verdict.certified is None:
        return f", {NOT_PROVEN}"
    return f", at most {format_length(_rounded_up(verdict.certified))} at any time"


def why_not(verdict: Verification, request: Request) -> str | None:
    """Return the reason for a missing bound of a clip, None if it is proven."""
    if verdict.certified is not None:
        return None
    if request.policy.reference is Reference.KEYS:
        return "only the source's keys count"
    return NOT_PROVEN


def _rounded_up(meters: float) -> float:
    """The length rounded up to two digits."""
    if meters <= 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(meters)) - 1)
    return math.ceil(meters / step - 1e-9) * step
