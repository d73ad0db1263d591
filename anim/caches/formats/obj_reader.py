"""Vertices, triangles and normals of an OBJ in the order of its lines, which trimesh changes for files with normals."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Ints
from anim.caches.formats.mesh_text import MAX_DIGITS, quote
from anim.errors import FormatError

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def read(data: bytes) -> tuple[AnyArray, Ints, AnyArray | None]:
    """Return positions (V, 3), triangles (T, 3), polygons as fans, and normals (V, 3) or None.

    Raises FormatError, with the line, for words that are no numbers, and for vertices that are not there.
    """
    rows: dict[bytes, list[list[float]]] = {b"v": [], b"vn": []}
    faces: list[list[int]] = []
    lines: list[int] = []  # of the triangles
    same_normals = True
    for number, line in enumerate(data.removeprefix(BYTE_ORDER_MARK).splitlines(), 1):
        words = line.split()
        if words and words[0] in rows:
            rows[words[0]].append(_three_numbers(words, number))
        elif words and words[0] == b"f":
            corners = [word.split(b"/") for word in words[1:]]
            indices = [_index(corner[0], len(rows[b"v"]), number) for corner in corners]
            same_normals &= all(len(corner) == 3 and corner[0] == corner[2] for corner in corners)
            faces += [[indices[0], indices[i], indices[i + 1]] for i in range(1, len(indices) - 1)]
            lines += [number] * (len(faces) - len(lines))
    positions = np.array(rows[b"v"], np.float64).reshape(-1, 3)
    triangles: Ints = np.array(faces, np.int64).reshape(-1, 3)
    _check_vertices(triangles, lines, len(positions))
    has_normals = same_normals and len(rows[b"vn"]) == len(rows[b"v"]) > 0
    normals = np.array(rows[b"vn"], np.float32).reshape(-1, 3) if has_normals else None
    return positions, triangles, normals


def _three_numbers(words: list[bytes], line: int) -> list[float]:
    """Numbers of a line "v x y z", which may have more."""
    found = []
    for word in words[1:4]:
        try:
            found.append(float(word))
        except ValueError:
            raise FormatError(f"line {line}: {quote(word)} is no number") from None
    if len(found) != 3:
        raise FormatError(f"line {line}: has {len(found)} numbers after {words[0].decode()} (expected 3)")
    return found


def _index(word: bytes, count: int, line: int) -> int:
    """Index of a vertex from its 1-based number, or from a negative one, counted from the last of `count`."""
    digits = word[1:] if word[:1] in (b"-", b"+") else word
    if not digits.isdigit() or len(digits) > MAX_DIGITS or not int(digits):
        raise FormatError(f"line {line}: {quote(word)} is no number of a vertex (expected 1 or more, or -1 or less)")
    number = int(word)
    if number < -count:
        raise FormatError(f"line {line}: a face uses vertex {number}, but {count} are before it")
    return number - 1 if number > 0 else count + number


def _check_vertices(triangles: Ints, lines: list[int], count: int) -> None:
    """Raise FormatError for the first face with a vertex that is not there."""
    if triangles.size and triangles.max() >= count:
        row = int((triangles >= count).any(axis=1).argmax())
        raise FormatError(f"line {lines[row]}: a face uses vertex {triangles[row].max() + 1} of {count}")
