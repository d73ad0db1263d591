"""Placeholders in output names: one file per clip from '{clip}.npz', per mesh from '{mesh}.npz'."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import PurePath

from cli.errors import UsageError

FORBIDDEN = frozenset('/\\:*?"<>|')  # invalid in names on some file systems
# Devices of Windows, which takes the superscripts of Latin-1 for digits
RESERVED = frozenset(
    (
        "con",
        "conin$",
        "conout$",
        "prn",
        "aux",
        "nul",
        *(f"{port}{i}" for port in ("com", "lpt") for i in "0123456789¹²³"),
    )
)
MAX_FILES = 2000  # of one command by default: a file of a few megabytes can name 100 000 clips
MAX_NAME_BYTES = 100  # of 255 in most file systems: the pattern may have several, and words around them
OF_PATHS = ("path", "folder", "name", "stem")  # of names that follow from an input's
_is_plain = re.compile(r"[A-Za-z0-9_-]*").fullmatch  # most names, of which nothing is replaced
_PLACEHOLDER = r"\{([A-Za-z_]\w*)\}"
_replace = re.compile(_PLACEHOLDER).sub


def check_placeholders(output: str, known: Sequence[str] = ()) -> None:
    """Raise UsageError for an unknown placeholder, such as {foo}, in an output name."""
    for name in re.findall(_PLACEHOLDER, output):
        if name not in known:
            expected = " or ".join(f"{{{each}}}" for each in known)
            raise UsageError(
                f"{output}: {{{name}}} stands for nothing (expected {expected or 'a name without { }'})",
                help="" if known else "bake writes a file per {clip} and {mesh}, convert to USD one per {clip}",
            )


def expand(output: str, rows: Sequence[Mapping[str, str]], numbers: Sequence[int]) -> list[str]:
    """Return a file name for each row, with placeholders replaced by the values of their keys.

    A value without a valid letter is replaced by the row's number; a duplicate name gets that number as a suffix.
    expand("{clip}.npz", [{"clip": "walk"}, {"clip": "Walk"}], [0, 3]) → ["walk.npz", "Walk-3.npz"]
    """
    names: list[str] = []
    taken: set[str] = set()
    for row, number in zip(rows, numbers, strict=True):
        values = {key: _plain(value) or str(number) for key, value in row.items()}
        last = next((key for key in reversed(values) if f"{{{key}}}" in output), "")
        while name_key(file := _filled(output, values)) in taken and last:
            values[last] += f"-{number}"
        names.append(file)
        taken.add(name_key(file))
    return names


def name_key(path: str) -> str:
    """Return a key that is equal for names which some file system takes for one.

    These ignore case, or the difference between a composed letter and a letter with a combining accent.
    name_key("Walk.glb") → "walk.glb"
    """
    if path.isascii():
        return path.lower()
    import unicodedata

    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def say_where_equal(name: str, other: str) -> str:
    """Return words for a message on two names of one file: empty if it is one everywhere, as by a link."""
    return " on file systems that ignore case" if name != other and name_key(name) == name_key(other) else ""


def fill_path(output: str, path: str, **others: str) -> str:
    """Return an output name with OF_PATHS replaced by those of an input's path, and others by their values.

    fill_path("build/{folder}/{stem}.gltf", "crowd/a.glb") → "build/crowd/a.gltf"
    """
    pure = PurePath(path)
    values = {"path": pure.as_posix(), "folder": pure.parent.as_posix(), "name": pure.name, "stem": pure.stem, **others}
    return PurePath(_filled(output, values)).as_posix()  # "a/./b" → "a/b"


def fixed_folder(output: str) -> str:
    """Return the folders of an output name before its first placeholder: "out" of "out/{path}"."""
    return output.partition("{")[0].rpartition("/")[0] or ("/" if output.startswith("/") else ".")


def _filled(output: str, values: Mapping[str, str]) -> str:
    return _replace(lambda match: values.get(match[1], match[0]), output)


def _plain(name: str) -> str:
    """The name as a part of a file name on every system; empty if none of it can be one."""
    if _is_plain(name) and len(name) <= MAX_NAME_BYTES and name.casefold() not in RESERVED:
        return name
    plain = "".join(c if _is_allowed(c) else "_" for c in name[:MAX_NAME_BYTES]).strip(". ")
    short = plain.encode()[:MAX_NAME_BYTES].decode(errors="ignore").strip(". ")
    return f"_{short}" if short.split(".")[0].strip().casefold() in RESERVED else short


def _is_allowed(character: str) -> bool:
    """False for what some file system refuses, or what the locale's encoding lacks."""
    try:
        character.encode(sys.getfilesystemencoding())
    except UnicodeEncodeError:
        return False
    return character not in FORBIDDEN and character.isprintable()
