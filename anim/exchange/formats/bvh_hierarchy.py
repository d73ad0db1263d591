"""HIERARCHY section of a BVH: words → joints; errors state the line."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple, NoReturn

from anim.errors import FormatError
from anim.exchange.formats.text import MAX_NUMBER, error_at, parse_count
from anim.exchange.formats.text import parse_number as number_of

CHANNELS = {f"{axis}{kind}".casefold(): (axis, kind) for axis in "XYZ" for kind in ("position", "rotation")}
MAX_JOINTS = 100_000
MAX_DEPTH = 10_000


class Word(NamedTuple):
    """A word, or a brace, and its line (from 1)."""

    text: str
    line: int


@dataclass(slots=True)
class BvhJoint:
    """A joint, or an End Site: offset in file units, channels ("X", "rotation") in file order."""

    name: str
    parent: int
    end: bool
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    channels: list[tuple[str, str]] = field(default_factory=list)


def read_hierarchy(lines: list[str]) -> tuple[list[BvhJoint], int, int]:
    """Return the joints, parents first, and the line (from 0) and the end column of the word MOTION.

    Accepts several ROOTs, joints with any channels in any order or none, names with spaces, statements on one line or
    many. Raises FormatError with the line for anything else.
    """
    for number, line in enumerate(lines):
        match = re.match(r"\s*MOTION\b", line, re.IGNORECASE)
        if match:
            joints = _Parser(lines[:number]).joints()
            return joints, number, match.end()
    _Parser(lines).joints()  # an earlier fault is reported first
    raise FormatError("the file ends before MOTION (truncated?)", where=f"line {max(len(lines), 1)}")


def fail(line: int, problem: str) -> NoReturn:
    """Raise the FormatError for a line."""
    raise error_at(line, problem)


class _Parser:
    def __init__(self, lines: list[str]) -> None:
        self._words = [
            Word(text, number) for number, line in enumerate(lines, 1) for text in re.findall(r"[{}]|[^\s{}]+", line)
        ]
        self._last = max(len(lines), 1)
        self._at = 0
        self._joints: list[BvhJoint] = []

    def joints(self) -> list[BvhJoint]:
        word = self._next("HIERARCHY")
        if word.text.casefold() != "hierarchy":
            fail(word.line, f"starts with '{_short(word.text)}' (expected HIERARCHY: is this a BVH file?)")
        open_joints: list[int] = []
        while self._at < len(self._words) or open_joints:
            word = self._next("'}'" if open_joints else "MOTION")
            keyword = word.text.casefold()
            if keyword == "}":
                if not open_joints:
                    fail(word.line, "'}' closes nothing")
                open_joints.pop()
            elif keyword in ("root", "joint", "end"):
                open_joints.append(self._joint(keyword, word.line, open_joints))
            elif not open_joints and keyword == "motion":
                fail(word.line, "'MOTION' is in a line with other words (expected it alone)")
            elif not open_joints:
                fail(word.line, f"'{_short(word.text)}' stands outside any joint (expected ROOT or MOTION)")
            elif keyword == "offset":
                x, y, z = (self._number("OFFSET") for _ in range(3))
                self._joints[open_joints[-1]].offset = (x, y, z)
            elif keyword == "channels":
                self._channels(self._joints[open_joints[-1]])
            else:
                fail(word.line, f"unknown word '{_short(word.text)}' (expected OFFSET, CHANNELS, JOINT, End or '}}')")
        if not self._joints:
            fail(self._last, "there is no ROOT")
        return self._joints

    def _next(self, expected: str) -> Word:
        if self._at == len(self._words):
            fail(self._last, f"the hierarchy ends here (expected {expected}; truncated?)")
        self._at += 1
        return self._words[self._at - 1]

    def _joint(self, keyword: str, line: int, open_joints: list[int]) -> int:
        if (keyword == "root") == bool(open_joints):
            fail(line, "ROOT inside a joint" if open_joints else f"{keyword.upper()} outside any ROOT")
        if open_joints and self._joints[open_joints[-1]].end:
            fail(line, "a joint inside an End Site")
        if len(self._joints) >= MAX_JOINTS or len(open_joints) >= MAX_DEPTH:
            fail(line, f"too many joints (limit {MAX_JOINTS}, {MAX_DEPTH} deep)")
        name = []
        while self._at < len(self._words) and self._words[self._at].line == line and self._words[self._at].text != "{":
            name.append(self._next("a name").text)
        brace = self._next("'{'")
        if brace.text != "{":
            fail(brace.line, f"'{_short(brace.text)}' after {keyword.upper()} {' '.join(name)} (expected '{{')")
        parent = open_joints[-1] if open_joints else -1
        label = f"{self._joints[parent].name}_end" if keyword == "end" else " ".join(name)
        self._joints.append(BvhJoint(label, parent, keyword == "end"))
        return len(self._joints) - 1

    def _number(self, what: str) -> float:
        word = self._next(f"a number of {what}")
        value = number_of(word.text)
        if value is None:
            fail(word.line, f"{what} holds '{_short(word.text)}' (expected three numbers up to {MAX_NUMBER:g})")
        return value

    def _channels(self, joint: BvhJoint) -> None:
        word = self._next("the number of CHANNELS")
        if not word.text.isascii() or not word.text.isdigit():
            fail(word.line, f"CHANNELS is followed by '{_short(word.text)}' (expected their number)")
        for _ in range(min(parse_count(word.text), len(self._words) + 1)):
            name = self._next("a channel")
            channel = CHANNELS.get(name.text.casefold())
            if channel is None:
                cut = "; truncated?" if self._at == len(self._words) else ""
                fail(name.line, f"unknown channel '{_short(name.text)}' (expected Xposition … Zrotation{cut})")
            if channel[1] == "position" and channel in joint.channels:
                fail(name.line, f"{name.text} twice in joint '{joint.name}'")
            joint.channels.append(channel)


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."
