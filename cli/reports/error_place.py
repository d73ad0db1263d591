"""Place of an error in words."""

from __future__ import annotations

from anim.measure.error.motion_error import MotionError


def describe_place(error: MotionError) -> str:
    """Return "at 'hand'", or "around 'socket', which moves no vertex"; the joint with the largest contribution."""
    return f"around '{error.place}', which moves no vertex" if error.is_around_node else f"at '{error.joint}'"
