"""Text tables, and the same rows as CSV."""

from __future__ import annotations

import io
from collections.abc import Sequence

MAX_QUOTED_LENGTH = 300  # characters of a problem, or of its position: names in a file can have any length
MAX_WORD_LENGTH = 40  # characters of a word that is left out whole where a text is cut
Cell = str | int | float | bool | None


def text(header: Sequence[str], rows: Sequence[Sequence[Cell]], *, left: int = 1, indent: str = "  ") -> str:
    """Return rows under a header, in columns: the first `left` ones to the left, numbers to the right.

    A column in which every cell is empty is left out.
    """
    columns = [_shown_column(column) for column in zip(*rows, strict=True)]
    kept = [i for i, column in enumerate(columns) if any(column)]
    aligned: list[list[str]] = []
    for i in kept:
        width = max(len(header[i]), *map(len, columns[i]))
        align = str.ljust if i < left else str.rjust
        aligned.append([align(cell, width) for cell in (header[i], *columns[i])])
    return "\n".join([(indent + "  ".join(line)).rstrip() for line in zip(*aligned, strict=True)]) + "\n"


def comma_separated(header: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """Return one CSV table with a header line; empty cells for None, "true" and "false" for booleans."""
    import csv

    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow(["" if c is None else str(c).lower() if isinstance(c, bool) else c for c in row])
    return out.getvalue()


def escape_control(words: str) -> str:
    """Return text with line breaks, terminal codes and other control characters escaped: \\n, \\x1b."""
    if words.isprintable():
        return words
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)


def cut_middle(words: str, length: int = MAX_QUOTED_LENGTH) -> str:
    """Return text of at most `length` characters, with "…" in the middle if it was longer.

    It is cut between words, unless a word there is longer than MAX_WORD_LENGTH.
    """
    if len(words) <= length:
        return words
    end = length // 3
    head, tail = words[: length - end - 1], words[-end:]
    if (last := head.rfind(" ", -MAX_WORD_LENGTH)) >= 0:
        head = head[: last + 1]
    if (first := tail.find(" ", 0, MAX_WORD_LENGTH)) >= 0:
        tail = tail[first:]
    return f"{head}…{tail}"


def quote(words: str, length: int = MAX_QUOTED_LENGTH) -> str:
    """Return text of at most `length` characters as it is shown: with escapes, each of which may be ten characters."""
    return cut_middle(escape_control(cut_middle(words, length)), length)


def _shown_column(cells: Sequence[Cell]) -> list[str]:
    shown = [cell if type(cell) is str else _shown(cell) for cell in cells]
    return shown if "".join(shown).isprintable() else list(map(escape_control, shown))


def _shown(cell: Cell) -> str:
    if cell is None or cell is False:
        return ""
    if cell is True:
        return "yes"
    return f"{cell:g}" if isinstance(cell, float) else str(cell)
