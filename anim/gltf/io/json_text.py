"""JSON text of a glTF file: parse without loss, write compact or with the input's indent."""

from __future__ import annotations

import functools
import json
import math
import re
from typing import NoReturn

from anim.errors import FormatError
from anim.gltf.document import Json

MARK = b"\xef\xbb\xbf"  # byte order mark of UTF-8, with which some editors begin text


def skip_mark(raw: bytes) -> bytes:
    """Return text without a byte order mark. Readers of JSON may accept one (RFC 8259), those of glTF must not."""
    return raw.removeprefix(MARK)


def check_mark(raw: bytes) -> None:
    """Raise FormatError for text with a byte order mark, also one of UTF-16."""
    if raw.startswith((MARK, b"\xff\xfe", b"\xfe\xff")):
        problem = "starts with a byte order mark (expected UTF-8 without one, as glTF requires)"
        raise FormatError(problem, help="save it as UTF-8 without BOM")


def parse(raw: bytes) -> Json:
    """Return the JSON object in `raw`, keys in its order.

    Raises FormatError, with line and column, for anything but a JSON object in UTF-8; NaN and Infinity are invalid.
    """
    try:
        parsed = json.loads(raw.decode("utf-8"), parse_float=_parse_number, parse_constant=_refuse_constant)
    except UnicodeDecodeError as error:
        raise FormatError(f"JSON is not UTF-8 (byte {error.start})") from None
    except json.JSONDecodeError as error:
        raise FormatError(f"JSON is broken at line {error.lineno}, column {error.colno}: {error.msg.lower()}") from None
    except RecursionError:
        raise FormatError("JSON is nested too deep") from None
    except ValueError as error:  # for example a number of thousands of digits
        raise FormatError(f"JSON holds a number that can't be read ({str(error).split(':')[0].lower()})") from None
    if not isinstance(parsed, dict):
        raise FormatError(f"JSON is a {type(parsed).__name__} (expected an object)")
    return parsed


def dump(content: Json, indent: int | None = None) -> bytes:
    """Return `content` as UTF-8: compact, or with `indent` spaces per level.

    Raises FormatError for a number that JSON cannot represent, and for a value that is no JSON, with its path.
    """
    separators = (",", ": ") if indent else (",", ":")
    text = functools.partial(json.dumps, content, indent=indent or None, separators=separators, allow_nan=False)
    try:
        try:
            return text(ensure_ascii=False).encode("utf-8")
        except UnicodeEncodeError:  # a lone surrogate, which can be written only as an escape
            return text().encode("ascii")
    except TypeError as error:
        path = _find_foreign(content, "")
        raise FormatError(
            f"is no JSON value ({str(error)[:1].lower()}{str(error)[1:]})", where=path or "JSON"
        ) from None
    except ValueError as error:
        raise FormatError(f"a number can't be written as JSON ({str(error).lower()})") from None


def _find_foreign(value: object, path: str) -> str:
    """Path of the first value, or object with a key, that JSON has no type for; "" if there is none."""
    if isinstance(value, dict):
        if not all(key is None or isinstance(key, str | int | float) for key in value):
            return path
        items = [(f"{path}.{key}" if path else str(key), item) for key, item in value.items()]
    elif isinstance(value, list | tuple):
        items = [(f"{path}[{i}]", item) for i, item in enumerate(value)]
    else:
        return "" if value is None or isinstance(value, str | int | float) else path
    return next(filter(None, (_find_foreign(item, where) for where, item in items)), "")


def indent_of(raw: bytes) -> int | None:
    """Return the spaces per indent level (a tab counts as one), None for text on one line."""
    match = re.match(rb"\s*\{[ \t]*\r?\n([ \t]+)", raw)
    return len(match[1]) if match else None


def _refuse_constant(name: str) -> NoReturn:
    raise FormatError(f"JSON holds {name} (no JSON number)")


def _parse_number(literal: str) -> float:
    value = float(literal)
    if math.isinf(value):
        raise FormatError(f"JSON holds a number too large for float64 (got {literal}, expected at most 1.8e308)")
    return value
