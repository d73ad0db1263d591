"""Exit codes, and the one line that says what went wrong."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from typing import Any

from typer import TyperException

from anim.errors import AnimError, FormatError, NotFoundError, RangeError, UnsupportedError

PROGRAM = "gltf-anim"
DONE, BUG, USAGE, FORMAT, UNSUPPORTED, NOT_FOUND, CHECK = range(7)
INTERRUPTED = 130
CODES: dict[type[AnimError], int] = {
    FormatError: FORMAT,
    UnsupportedError: UNSUPPORTED,
    NotFoundError: NOT_FOUND,
    RangeError: USAGE,
}


class UsageError(AnimError):
    """The command line asks for something that can't be done: exit 2."""


class CheckError(AnimError):
    """A check that the user asked for said no: exit 6."""


CODES[UsageError] = USAGE
CODES[CheckError] = CHECK


def guarded(job: Callable[[], Any]) -> int:
    """Run a job and return the exit code; one line on stderr for what went wrong, a traceback only for our own bugs."""
    try:
        code = job()
        return code if isinstance(code, int) and not isinstance(code, bool) else DONE
    except AnimError as error:
        return reported(error)
    except TyperException as error:
        _say(_usage(error), "")
        return USAGE
    except KeyboardInterrupt:
        return INTERRUPTED
    except MemoryError:
        _say("out of memory", "")
        return UNSUPPORTED
    except Exception:
        traceback.print_exc()
        _say("this is a bug of ours; please report the lines above", "")
        return BUG


def reported(error: AnimError) -> int:
    """Say what was refused, in one line and maybe a hint, and return its exit code."""
    code = CODES.get(type(error), BUG)
    if code == BUG:
        traceback.print_exc()
    _say(str(error), error.help)
    return code


def _usage(error: TyperException) -> str:
    context = getattr(error, "ctx", None)
    command = getattr(context, "info_name", None)
    words = " ".join(error.format_message().split())
    words = words[:1].lower() + words[1:].rstrip()
    at = f"{command}: " if command and command != PROGRAM else ""
    hint = f" (see '{getattr(context, 'command_path', PROGRAM)} --help')"
    return at + words.rstrip(".") + hint


def _say(problem: str, hint: str) -> None:
    sys.stderr.write(f"{PROGRAM}: {problem}\n")
    if hint:
        sys.stderr.write(f"help: {hint}\n")
