"""Tables of settings: `gltf-anim.toml`, or `[tool.gltf-anim]` of pyproject.toml, and checks of their keys."""

from __future__ import annotations

import difflib
import errno
import math
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

from anim.errors import FormatError, UnsupportedError
from anim.files.special_files import is_device_or_pipe, open_regular
from cli.errors import UsageError
from cli.io import command_files
from cli.tables import cut_middle

NAME, PROJECT = "gltf-anim.toml", "pyproject.toml"
Keys: TypeAlias = Mapping[str, type | tuple[type, ...]]  # allowed keys, and the types of their values
TYPE_NAMES = {str: "text", bool: "true or false", int: "a whole number", list: "a list", dict: "a table"}
MAX_INTEGER = 2**63 - 1  # of TOML
MAX_BYTES = 1_000_000  # of settings, which people write
MAX_KEY_WORK = 10**8  # a key of 10 000 parts, or a [header] of 500 above 20 000 lines: some seconds
SECTIONS: Keys = {"check": dict, "budget": list, "recipe": list}


def find_table(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """Return the nearest settings, from a folder upwards, and their file; None without any."""
    for each in (folder, *folder.parents):
        tables = [(path, table) for path in (each / NAME, each / PROJECT) if (table := _table(path)) is not None]
        if len(tables) > 1:
            raise UsageError(f"{each}: has {NAME} and [tool.gltf-anim] in {PROJECT} (expected one of them)")
        if tables:
            return tables[0]
    return None


def read_table(path: str) -> dict[str, Any]:
    """Return the settings in a file. Raises FormatError if there is none, UsageError if it has none."""
    table = _table(Path(path))
    if table is None and not Path(path).exists():
        raise FormatError(f"can't be read ({os.strerror(errno.ENOENT).lower()})", where=path)
    if table is None:
        raise UsageError(f"{path}: has no [tool.gltf-anim]")
    return table


def check_keys(path: Path | str, section: str, table: Any, known: Keys) -> None:
    """Raise UsageError for an unknown key or a value of another type.

    path: of the settings, also with the number of the table. section: name of the table, "" for all.
    """
    if not isinstance(table, dict):
        raise UsageError(f"{path}: [{section}] is no table")
    for key, value in table.items():
        where = f"{section}.{key}".lstrip(".")
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            raise UsageError(f"{path}: unknown key '{where}'", help=f"did you mean {near[0]}?" if near else "")
        kind = known[key]
        if not isinstance(value, kind):
            expected = TYPE_NAMES[kind] if isinstance(kind, type) else "a number"
            raise UsageError(f"{path}: {where} is {cut_middle(repr(value))} (expected {expected})")
        if isinstance(value, float) and not math.isfinite(value):  # a limit that no file exceeds
            raise UsageError(f"{path}: {where} is {value} (expected a finite number)")


def _table(path: Path) -> dict[str, Any] | None:
    """The settings in a file, None if it has none."""
    try:
        content = tomllib.loads(_read(path).decode("utf-8-sig"))
    except (FileNotFoundError, NotADirectoryError):  # as above a file that is taken for a folder
        return None
    except OSError as error:
        raise FormatError(f"can't be read ({(error.strerror or str(error)).lower()})", where=str(path)) from None
    except RecursionError:
        raise UsageError(f"{path}: is nested too deep") from None
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: is no TOML: byte {error.start} is not UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{path}: {error}") from None
    except ValueError:  # Python's limit of digits
        raise UsageError(f"{path}: has a whole number of thousands of digits (TOML has 64 bits)") from None
    table: object = content
    if path.name == PROJECT:
        tools = content.get("tool")
        table = tools.get("gltf-anim") if isinstance(tools, dict) else None
    if not isinstance(table, dict):
        return None
    try:
        _check_integers(path, "", table)
    except RecursionError:
        raise UsageError(f"{path}: is nested too deep") from None
    return table


def _read(path: Path) -> bytes:
    """The bytes of a regular file: a pipe would be waited for, and a device may never end.

    Raises FileNotFoundError, OSError, FormatError, and UnsupportedError for more than MAX_BYTES.
    """
    if is_device_or_pipe(path):
        raise FormatError("is no regular file", where=str(path))
    with open_regular(path) as file:
        data = file.read(MAX_BYTES + 1)
    command_files.add_inputs(path)
    if len(data) > MAX_BYTES:
        raise UnsupportedError(f"has more than {MAX_BYTES / 1e6:.0f} MB (settings are short)", where=str(path))
    if _key_work(data) > MAX_KEY_WORK:
        raise UnsupportedError("has lines of thousands of dots (keys have a few)", where=str(path))
    return data


def _key_work(data: bytes) -> int:
    """The most that dotted keys may cost: their parts squared, and those of a header for each line below it.

    Each dot of a line counts, also of texts: none has so many.
    """
    lines = data.split(b"\n")
    dots = [line.count(b".") for line in lines]
    headers = (count for line, count in zip(lines, dots, strict=True) if line.lstrip()[:1] == b"[")
    return sum(count * count for count in dots) + 10 * max(headers, default=0) * len(lines)


def _check_integers(path: Path, where: str, value: object) -> None:
    """Raise UsageError for a whole number beyond the 64 bits of TOML: no float, and no message, may hold it."""
    if isinstance(value, dict):
        for key, each in value.items():
            _check_integers(path, f"{where}.{key}".lstrip("."), each)
    elif isinstance(value, list):
        for each in value:
            _check_integers(path, where, each)
    elif isinstance(value, int) and not -MAX_INTEGER - 1 <= value <= MAX_INTEGER:
        raise UsageError(f"{path}: {where} is a whole number that TOML can't hold (expected 64 bits)")
