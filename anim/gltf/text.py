"""JSON text of a glTF file: parsed without loss, written small, or laid out as it was."""

from __future__ import annotations

import json
import re
from typing import Any, NoReturn

from anim.errors import FormatError
from anim.gltf.document import Json


def parse(raw: bytes) -> Json:
    """Return the JSON object in `raw`, keys in its order.

    Raises FormatError, with line and column, for anything that is no JSON object in UTF-8; NaN and Infinity are none.
    """
    try:
        parsed = json.loads(raw.decode("utf-8"), parse_constant=_refuse_constant)
    except UnicodeDecodeError as error:
        raise FormatError(f"JSON is not UTF-8 (byte {error.start})") from None
    except json.JSONDecodeError as error:
        hint = "starts with a byte order mark" if raw[:3] == b"\xef\xbb\xbf" else error.msg.lower()
        raise FormatError(f"JSON is broken at line {error.lineno}, column {error.colno}: {hint}") from None
    except RecursionError:
        raise FormatError("JSON is nested too deep") from None
    except ValueError as error:  # a number of thousands of digits
        raise FormatError(f"JSON holds a number that can't be read ({str(error).split(':')[0].lower()})") from None
    if not isinstance(parsed, dict):
        raise FormatError(f"JSON is a {type(parsed).__name__} (expected an object)")
    return parsed


def dump(content: Json, indent: int | None = None) -> bytes:
    """Return `content` as UTF-8: without any spaces, or with `indent` spaces a level and plain lists on one line.

    Raises FormatError for a number that JSON can't hold.
    """
    try:
        if indent:
            written = "".join(_pieces(content, " " * indent, "\n"))
        else:
            written = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        return written.encode("utf-8")
    except UnicodeEncodeError:  # a lone surrogate, which only an escape can carry
        return json.dumps(content, separators=(",", ":"), indent=indent, allow_nan=False).encode("ascii")
    except ValueError as error:  # a number like 1e999, which was read as infinity
        raise FormatError(f"a number can't be written as JSON ({str(error).lower()})") from None


def indent_of(raw: bytes) -> int | None:
    """Return how many spaces (a tab counts as one) the text indents a level by, None where it is on one line."""
    match = re.match(rb"\s*\{[ \t]*\r?\n([ \t]+)", raw)
    return len(match[1]) if match else None


def _refuse_constant(name: str) -> NoReturn:
    raise FormatError(f"JSON holds {name} (no JSON number)")


def _pieces(value: Any, step: str, line: str) -> list[str]:
    if not isinstance(value, dict | list) or not value or _is_plain_list(value):
        return [json.dumps(value, ensure_ascii=False, allow_nan=False)]
    inner = line + step
    opening, closing = ("{", "}") if isinstance(value, dict) else ("[", "]")
    pieces = [opening]
    rows = value.items() if isinstance(value, dict) else ((None, item) for item in value)
    for i, (key, item) in enumerate(rows):
        pieces.append("," + inner if i else inner)
        if key is not None:
            pieces.append(json.dumps(key, ensure_ascii=False) + ": ")
        pieces += _pieces(item, step, inner)
    return [*pieces, line, closing]


def _is_plain_list(value: Any) -> bool:
    return isinstance(value, list) and not any(isinstance(item, dict | list) for item in value)
