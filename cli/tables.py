"""Text tables, and the same rows as CSV."""

from __future__ import annotations

import io
from collections.abc import Sequence

MAX_QUOTED_LENGTH = 300  # characters of a problem, or of its position: names in a file can have any length
Cell = str | int | float | bool | None


def text(header: Sequence[str], rows: Sequence[Sequence[Cell]], *, left: int = 1, indent: str = "  ") -> str:
    """Return rows under a header, in columns: the first `left` ones to the left, numbers to the right.

    A column in which every cell is empty is left out.
    """
    cells = [[_shown(cell) for cell in row] for row in rows]
    kept = [i for i in range(len(header)) if any(row[i] for row in cells)]
    widths = {i: max(len(header[i]), *(len(row[i]) for row in cells)) for i in kept}
    line = (indent + "  ".join(f"{{{i}:{'<' if i < left else '>'}{widths[i]}}}" for i in kept)).format
    return "\n".join(line(*row).rstrip() for row in [list(header), *cells]) + "\n"


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
    """Return text of at most `length` characters, with "…" in the middle if it was longer."""
    if len(words) <= length:
        return words
    end = length // 3
    return f"{words[: length - end - 1]}…{words[-end:]}"


def _shown(cell: Cell) -> str:
    if type(cell) is str:  # most cells
        return cell if cell.isprintable() else escape_control(cell)
    if cell is None or cell is False:
        return ""
    if cell is True:
        return "yes"
    return f"{cell:g}" if isinstance(cell, float) else escape_control(str(cell))
