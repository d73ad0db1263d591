"""Exit codes, and error messages of one line."""

from __future__ import annotations

import re
import traceback
from collections.abc import Callable, Sequence
from typing import Any

from typer import TyperException

from anim.errors import (
    AnimError,
    DataRangeError,
    FormatError,
    NotFoundError,
    OutputError,
    RangeError,
    UnstableError,
    UnsupportedError,
    is_out_of_memory,
)
from cli.tables import quote
from cli.text import Reporter

PROGRAM = "gltf-anim"
DONE, BUG, USAGE, FORMAT, UNSUPPORTED, NOT_FOUND, CHECK = range(7)
INTERRUPTED = 130
CODES: dict[type[AnimError], int] = {
    FormatError: FORMAT,
    UnsupportedError: UNSUPPORTED,
    NotFoundError: NOT_FOUND,
    RangeError: USAGE,
    DataRangeError: FORMAT,
    OutputError: FORMAT,
    UnstableError: CHECK,
}


class UsageError(AnimError):
    """The command line is invalid: exit 2."""


class RefusedOutputError(UsageError):
    """An output can't be made at its place, or would replace what the command reads or writes: exit 2.

    Of many files, the others are made.
    """


class NoFileError(FormatError):
    """A folder, a pattern or a recipe names no file: exit 3, as for a name of no file."""


class CheckError(AnimError):
    """A requested check failed: exit 6."""


CODES[UsageError] = CODES[RefusedOutputError] = USAGE
CODES[NoFileError] = FORMAT
CODES[CheckError] = CHECK


def run_guarded(job: Callable[[], Any], args: Sequence[str] = (), received: Sequence[int] = ()) -> int:
    """Run a job and return the exit code; errors are a line on stderr, tracebacks for internal ones only.

    args: of the command line, for the hint on a file name that looks like an option. received: signals; an error after
    one is its consequence, in a package that discarded the exception of the signal.
    """
    try:
        code = job()
        return code if isinstance(code, int) and not isinstance(code, bool) else DONE
    except AnimError as error:
        return report_error(error)
    except TyperException as error:
        problem, hint = usage_problem(error)
        _print_error(problem, _file_hint(error, args) or hint)
        return USAGE
    except KeyboardInterrupt:
        return INTERRUPTED
    except RecursionError:
        _print_error("the input is nested too deep", "")
        return FORMAT
    except Exception as error:
        if (ended := _end_of(error)) is not None:
            return ended
        if received:
            return 128 + received[0]
        if is_out_of_memory(error):
            _print_error("out of memory", "")
            return UNSUPPORTED
        _print_trace()
        _print_error("this is a bug of ours; please report the lines above", "")
        return BUG


def _end_of(error: BaseException | None) -> int | None:
    """Exit code of a signal that some package turned into another exception; None for other errors."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return INTERRUPTED
        if isinstance(error, SystemExit) and isinstance(error.code, int):
            return error.code
        error = error.__cause__ or error.__context__
    return None


def common_options(text: str) -> str:
    """Return a text of the library's with the options that all commands have."""
    return text.replace("`memory_limit`", "--memory-limit")


def report_error(error: AnimError, *, is_shown: bool = False) -> int:
    """Report an error as one line, with its help if any, and return the exit code.

    is_shown: the user has read it already, in a report: then only the help is new.
    """
    code = CODES.get(type(error), BUG)
    if code == BUG:
        vars(error).pop("__notes__", None)  # the help, which is written separately
        _print_trace()
    where = f"{quote(error.where)}: " if error.where else ""
    # Reports of several files print errors on their own, without the options of a command
    _print_error("" if is_shown else where + quote(error.problem), common_options(error.help))
    return code


def _file_hint(error: TyperException, args: Sequence[str]) -> str:
    """Hint for an unknown option that is the name of a file: -x.glb."""
    unknown = "no such option" in str(error.format_message()).lower()
    files = [each for each in args if re.fullmatch(r"-[^-].*\.[A-Za-z]\w{1,4}", each)]
    return f"if it is a file, write ./{files[0]}" if unknown and files else ""


def usage_problem(error: TyperException) -> tuple[str, str]:
    """Return the problem of a command line, and the hint for it."""
    context = getattr(error, "ctx", None)
    command = getattr(context, "info_name", None)
    near = getattr(error, "possibilities", None) or ()
    words = " ".join((error.args[0] if near else error.format_message()).split())
    words, found, suggestion = words.partition("Did you mean")
    at = f"{command}: " if command and command != PROGRAM else ""
    problem = at + words[:1].lower() + words[1:].rstrip(" .")
    if found:
        return problem, f"did you mean{suggestion}"
    if near:
        return problem, f"did you mean {' or '.join(repr(each) for each in sorted(near))}?"
    if getattr(error, "option_name", "") in ("-o", "--out", "--output") and _has_output(context):
        return problem, "the output is the second name, without an option: IN OUT"
    return problem, f"{getattr(context, 'command_path', PROGRAM)} --help"


def _has_output(context: Any) -> bool:
    return any(param.name == "output" for param in context.command.params)


def _print_error(problem: str, hint: str) -> None:
    reporter = Reporter()  # the exit code stays the same if stderr is closed
    if problem:
        reporter.info(f"{PROGRAM}: {problem}")
    if hint:
        reporter.info(f"help: {quote(hint)}")


def _print_trace() -> None:
    for line in traceback.format_exc().rstrip("\n").split("\n"):
        Reporter().info(line)
