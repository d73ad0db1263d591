"""Errors of the library.

AnimError
├─ FormatError       the input is not valid glTF (or BVH, PC2 ...), or can't be read
├─ UnsupportedError  the input is valid but unsupported: a required extension, a missing extra
├─ NotFoundError     no such clip, node, skin or mesh
├─ RangeError        a parameter outside its valid range
│  └─ DataRangeError  values of a file, or results from them, outside their valid range
├─ ShapeError        an array of the wrong shape or type: an error of the caller
├─ UnstableError     a simulation that diverges: not finite, or with more energy than it can have
└─ OutputError       the output can't be written: a full or read-only disk, no permission
"""

from __future__ import annotations

import errno
from typing import Any, Self

MAX_SHOWN = 80  # characters of a value in a message
_NO_MEMORY = (
    "cannot allocate memory",
    "failed to map segment",  # of the system's loader
    "can't start new thread",
)


class AnimError(Exception):
    """Base of all errors: problem, position and help.

    problem: one line with the actual and the expected value; parameters of the caller's are written as `name`, for
    which the command line puts the option's name.
    where: the position from the outside in, "clip 'walk', track 3"; empty if the problem contains it.
    help: one line of advice, or empty; tracebacks show it too.
    """

    def __init__(self, problem: str, *, where: str = "", help: str = "") -> None:
        super().__init__(problem)
        self.problem = problem
        self.where = where
        self.help = ""
        self.advise(help)

    def __str__(self) -> str:
        return f"{self.where}: {self.problem}" if self.where else self.problem

    def advise(self, help: str) -> Self:
        """Return this error with `help` unless it has one already; tracebacks show it as a note."""
        if help and not self.help:
            self.help = help
            self.add_note(f"help: {help}")
        return self

    def at(self, where: str, separator: str = ", ") -> Self:
        """Return this error with its position prefixed by `where`, known to the caller."""
        self.where = f"{where}{separator}{self.where}" if self.where else where
        return self


class FormatError(AnimError):
    """The input violates its format, or can't be read."""


class UnsupportedError(AnimError):
    """The input is valid, but needs something unsupported or not installed."""


class NotFoundError(AnimError):
    """Nothing in the input has this name or index."""


class RangeError(AnimError):
    """A parameter is outside its valid range."""


class DataRangeError(RangeError):
    """Values of a file, or results computed from them, are outside their valid range: no parameter is to blame."""


class ShapeError(AnimError):
    """An array has the wrong shape or type."""


class UnstableError(AnimError):
    """A simulation diverges: values that are not finite, or far more energy than was put in.

    report: of the run until then, a `SimulationReport`, or None.
    """

    report: Any = None

    def with_report(self, report: object) -> Self:
        """Return this error with the report of its run."""
        self.report = report
        return self


class OutputError(AnimError):
    """The output can't be written: a full or read-only disk, no permission."""


def not_written(name: object, error: OSError) -> OutputError:
    """Return the error for an output, `name`, that the system can't write.

    Raises MemoryError if memory ran out: loading a library then raises OSError, too.
    """
    if is_out_of_memory(error):
        raise MemoryError
    return OutputError(f"{name}: can't be written ({(error.strerror or str(error)).lower()})")


def check_type(value: object, expected: type, name: str, *, help: str = "") -> None:
    """Raise ShapeError unless `value`, named `name`, is an instance of `expected`."""
    if not isinstance(value, expected):
        got = "None" if value is None else type(value).__name__
        raise ShapeError(f"{name} is {got} (expected {expected.__name__})", help=help)


def check_number(value: object, name: str) -> float:
    """Return `value`, named `name`, as a float: numpy's scalars would compute, and overflow, in their own precision.

    Raises ShapeError unless it is a real number, as True and False are not, RangeError for one beyond all floats.
    """
    import numbers

    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ShapeError(f"`{name}` is {in_one_line(value)} (expected a number)")
    try:
        return float(value)
    except OverflowError:
        raise RangeError(f"`{name}` is beyond all floats (expected at most 1.8e308 in magnitude)") from None


def in_one_line(value: object) -> str:
    """Return the representation of a value for messages, or its type if that is long, as of arrays."""
    text = repr(value)
    return text if len(text) <= MAX_SHOWN and "\n" not in text else type(value).__name__


def is_out_of_memory(error: BaseException | None) -> bool:
    """Return whether an error, or one of its causes, means that memory ran out."""
    while error is not None:
        words = str(error).lower()
        if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
            return True
        if isinstance(error, (OSError, ImportError, RuntimeError)) and any(each in words for each in _NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False
