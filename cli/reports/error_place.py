"""Parts of an error in words: its place, and what is no distance."""

from __future__ import annotations

from anim.measure.error.motion_error import MotionError
from anim.units import format_number


def describe_place(error: MotionError) -> str:
    """Return "at 'hand'", or "around 'socket', which moves no vertex"; the joint with the largest contribution."""
    return f"around '{error.place}', which moves no vertex" if error.is_around_node else f"at '{error.joint}'"


def describe_pointers(error: MotionError) -> str:
    """Return ", pointers max 3 % of range at …", of tracks that move no vertex; "" without an error of theirs."""
    if error.max_pointer_error <= 0:
        return ""
    return f", pointers max {format_number(100 * error.max_pointer_error, 2)} % of range at {error.pointer}"
