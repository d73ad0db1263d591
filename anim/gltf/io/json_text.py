"""JSON text of a glTF file: parsed without loss, written small, or laid out as it was."""

from __future__ import annotations

import json
import math
import re
from typing import Any, NoReturn

from anim.errors import FormatError
from anim.gltf.document import Json


class Beyond(float):
    """A number too large for any float: it counts as infinite, and is written as it stood in the file: 1e999."""

    __slots__ = ("literal",)
    literal: str

    def __new__(cls, literal: str) -> Beyond:
        """Return the number of a text of digits."""
        made = super().__new__(cls, literal)
        made.literal = literal
        return made


def parse(raw: bytes) -> Json:
    """Return the JSON object in `raw`, keys in its order.

    Raises FormatError, with line and column, for anything that is no JSON object in UTF-8; NaN and Infinity are none.
    """
    try:
        parsed = json.loads(raw.decode("utf-8"), parse_float=_number, parse_constant=_refuse_constant)
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

    Raises FormatError for a number that JSON can't hold, and that was not read from any.
    """
    step = " " * indent if indent else ""
    try:
        try:
            return _written(content, step, plain=False).encode("utf-8")
        except UnicodeEncodeError:  # a lone surrogate, which only an escape can carry
            return _written(content, step, plain=True).encode("ascii")
    except ValueError as error:
        raise FormatError(f"a number can't be written as JSON ({str(error).lower()})") from None


def indent_of(raw: bytes) -> int | None:
    """Return how many spaces (a tab counts as one) the text indents a level by, None where it is on one line."""
    match = re.match(rb"\s*\{[ \t]*\r?\n([ \t]+)", raw)
    return len(match[1]) if match else None


def _refuse_constant(name: str) -> NoReturn:
    raise FormatError(f"JSON holds {name} (no JSON number)")


def _number(literal: str) -> float:
    value = float(literal)
    return value if math.isfinite(value) else Beyond(literal)


def _written(content: Json, step: str, *, plain: bool) -> str:
    """The text; `step`: what a level is indented by, nothing for one line. plain: ASCII only."""
    if step:
        return "".join(_laid_out(content, step, "\n", plain))
    try:
        return _compact(content, plain)
    except ValueError:
        return _with_literals(content, plain)


def _compact(value: Any, plain: bool) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=plain, allow_nan=False)


def _with_literals(value: Any, plain: bool) -> str:
    """What `_compact` writes, where a `Beyond` stands somewhere in the value."""
    if isinstance(value, Beyond):
        return value.literal
    if isinstance(value, dict):
        return f"{{{','.join(f'{_compact(key, plain)}:{_with_literals(item, plain)}' for key, item in value.items())}}}"
    if isinstance(value, list):
        return f"[{','.join(_with_literals(item, plain) for item in value)}]"
    return _compact(value, plain)


def _laid_out(value: Any, step: str, line: str, plain: bool) -> list[str]:
    if not isinstance(value, dict | list) or not value or _is_plain_list(value):
        return [_on_one_line(value, plain)]
    inner = line + step
    opening, closing = ("{", "}") if isinstance(value, dict) else ("[", "]")
    pieces = [opening]
    rows = value.items() if isinstance(value, dict) else ((None, item) for item in value)
    for i, (key, item) in enumerate(rows):
        pieces.append("," + inner if i else inner)
        if key is not None:
            pieces.append(_compact(key, plain) + ": ")
        pieces += _laid_out(item, step, inner, plain)
    return [*pieces, line, closing]


def _is_plain_list(value: Any) -> bool:
    return isinstance(value, list) and not any(isinstance(item, dict | list) for item in value)


def _on_one_line(value: Any, plain: bool) -> str:
    try:
        return json.dumps(value, ensure_ascii=plain, allow_nan=False)
    except ValueError:
        if not isinstance(value, list):
            return _with_literals(value, plain)
        return f"[{', '.join(_with_literals(item, plain) for item in value)}]"
