"""Faults in the numbers of text meshes, by line: what their parsers say of them is meant for programmers."""

from __future__ import annotations

from collections.abc import Iterator

MAX_DIGITS = 18  # of integers, which int64 always holds
MAX_QUOTED = 20  # characters
HEADER_BYTES = 4096  # of a PLY; contain its format


def number_fault(data: bytes, ending: str) -> str:
    """Return "line 12: 'x' is no number" for the first such word of a text PLY or STL; "" without one."""
    for line, words in _lines_of_numbers(data, ending):
        for word in words:
            try:
                float(word)
            except ValueError:
                return f"line {line}: {quote(word)} is no number"
            if word.lstrip(b"+-").isdigit() and len(word.lstrip(b"+-")) > MAX_DIGITS:
                return f"line {line}: {quote(word)} is too large a number"
    return ""


def quote(word: bytes) -> str:
    """Return a word of a file for a message, cut if it is long."""
    text = word[:MAX_QUOTED].decode("ascii", "replace")
    return f"'{text}{'…' if len(word) > MAX_QUOTED else ''}'"


def _lines_of_numbers(data: bytes, ending: str) -> Iterator[tuple[int, list[bytes]]]:
    """Lines that contain only numbers, by their number from 1: of a PLY all after its header."""
    is_body = False
    if ending == ".ply" and b"format ascii" not in data[:HEADER_BYTES]:
        return
    for number, line in enumerate(data.splitlines(), 1):
        words = line.split()
        if ending == ".stl" and words[:1] == [b"vertex"]:
            yield number, words[1:]
        elif is_body:
            yield number, words
        elif ending == ".ply" and words[:1] == [b"element"]:
            yield number, words[2:]
        is_body |= ending == ".ply" and words == [b"end_header"]
