"""Kinds of loops."""

from __future__ import annotations

from enum import StrEnum


class LoopKind(StrEnum):
    """Kind of a loop, by the difference between a clip's end and its start."""

    CLOSED = "closed"
    OPEN_BY_ONE_FRAME = "open by one frame"
    CLOSED_EXCEPT = "closed except some joints"
    NOT_A_LOOP = "not a loop"
    SINGLE_POSE = "a single pose"
