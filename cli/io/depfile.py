"""Dependency files for make and ninja: the output of a command, and every file that it read."""

from __future__ import annotations

import re
from collections.abc import Sequence

# With these make takes the line for two lines, a variable, a recipe, or the start of what is needed only first.
UNESCAPABLE = {"\n": "a line break", "\r": "a line break", "=": "'='", ";": "';'", "|": "'|'"}


def rule(outputs: Sequence[str], inputs: Sequence[str]) -> str:
    """Return a rule in the syntax of make, which ninja reads too: "walk.glb: in.gltf in.bin".

    Each input is a target without a rule of its own, so that make goes on when it is removed, as by `gcc -MP`.
    rule(["a b.glb"], ["in.gltf"]) → "a\\\\ b.glb: in.gltf\\nin.gltf:"
    """
    needed = [each for each in inputs if each not in outputs]
    rule = f"{' '.join(map(escape_target, outputs))}:{''.join(f' {escape(each)}' for each in needed)}\n"
    return rule + "".join(f"{escape_target(each)}:\n" for each in needed)


def escape_target(path: str) -> str:
    """Return a path escaped as a target, of which make takes a % for a pattern, but not among what it needs.

    escape_target("50%.glb") → "50\\%.glb"
    """
    return re.sub(r"(\\*)%", r"\1\1\\%", escape(path))


def escape(path: str) -> str:
    """Return a path with spaces, #, $ and colons, but for that of a drive, escaped, as compilers do.

    Those of `UNESCAPABLE` can't be escaped.
    """
    words = []
    for i, character in enumerate(path):
        if character in " \t":  # make takes backslashes before a space as escapes of each other
            words.append("\\" * (_backslashes_before(path, i) + 1))
        elif character == "#" or (character == ":" and not _is_drive(path, i)):
            words.append("\\")
        elif character == "$":
            words.append("$")
        words.append(character)
    return "".join(words)


def _is_drive(path: str, colon: int) -> bool:
    """Tell whether the colon ends the name of a drive: "C:\\x.glb"."""
    return colon == 1 and path[0].isalpha() and path[2:3] in ("/", "\\")


def _backslashes_before(path: str, end: int) -> int:
    return end - len(path[:end].rstrip("\\"))
