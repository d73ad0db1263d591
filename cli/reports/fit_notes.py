"""Words on the tolerances within which eased motion is fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping

from anim.model import Clip, Interpolation, Track, ValueKind
from anim.units import format_number

DIGITS = 3  # of a tolerance, as it was given


def describe_easing(
    before: Mapping[int, Clip],
    after: Mapping[int, Clip],
    *,
    is_cubic: bool,
    tolerance: float,
    angle_tolerance: float,
    range_of: str,
) -> str:
    """Return "easing within 0.05° and 0.1 % of each track's range", "easing exact" if no track is fitted.

    before, after: the changed clips by index. is_cubic: whether the easing has an exact form. tolerance: fraction of
    the range of what `range_of` names. angle_tolerance: rad.
    """
    fitted = {
        new.kind is ValueKind.ROTATION
        for i, clip in before.items()
        for old, new in zip(clip.tracks, after[i].tracks, strict=True)
        if old is not new and _is_fitted(old, new, is_cubic=is_cubic)
    }
    parts = [f"{format_number(math.degrees(angle_tolerance), DIGITS)}°"] if True in fitted else []
    if False in fitted:
        parts.append(f"{format_number(100 * tolerance, DIGITS)} % of each {range_of}'s range")
    return f"easing within {' and '.join(parts)}" if parts else "easing exact"


def _is_fitted(old: Track, new: Track, *, is_cubic: bool) -> bool:
    """Return whether an eased track has no exact form: of LINEAR vectors CUBICSPLINE has one, of keys held STEP."""
    if new.interpolation is Interpolation.STEP:
        return False
    has_form = old.interpolation is Interpolation.LINEAR and new.interpolation is Interpolation.CUBICSPLINE
    return not (is_cubic and has_form) or new.kind is ValueKind.ROTATION
