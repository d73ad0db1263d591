"""Questions of a command before it changes files: whether it may replace them, and what must be done before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Protocol

from anim.files import resolver, special_files


class Guard(Protocol):
    """Knows the files that a command reads and writes."""

    def plan(self, main: Path, companions: Iterable[Path], *, in_place: bool, suffix: str) -> None:
        """Raise an error if one of these files may not be replaced.

        main: with links resolved. in_place: it may be an input, which is then replaced with its companions.
        suffix: of the name by which it is written, which can be a link's.
        """

    def plan_new(self, paths: Iterable[Path]) -> None:
        """Raise an error if one of these files is another output's. They are new, or stay as they are."""

    def add_copy(self, path: Path) -> None:
        """Note that an image was copied to a path."""

    def begin(self) -> None:
        """Do what waits for the first change of a file; an error of it leaves all of them."""


_guard: ContextVar[Guard | None] = ContextVar("guard", default=None)


@contextmanager
def use(guard: Guard | None) -> Iterator[None]:
    """Ask this guard inside the block; none for None."""
    token = _guard.set(guard)
    try:
        yield
    finally:
        _guard.reset(token)


def current() -> Guard | None:
    """Return the guard that is asked here."""
    return _guard.get()


def plan(path: Path, companions: Iterable[Path] = (), *, in_place: bool = False, suffix: str | None = None) -> None:
    """Ask whether these files may be replaced, before the first of them is: see `Guard.plan`. Special files may be.

    suffix: None for that of `path`.
    """
    if (guard := current()) is not None and not special_files.is_special(path):
        others = [each for each in companions if not special_files.is_special(each)]
        guard.plan(
            resolver.resolve_links(path), others, in_place=in_place, suffix=path.suffix if suffix is None else suffix
        )


def plan_new(paths: Iterable[Path]) -> None:
    """Ask whether these new files are outputs of their own: see `Guard.plan_new`."""
    if (guard := current()) is not None:
        guard.plan_new(paths)


def add_copy(path: Path) -> None:
    """Note that an image was copied to a path where it was not before."""
    if (guard := current()) is not None:
        guard.add_copy(path)


def begin() -> None:
    """Do what waits for the first change of a file: call it before."""
    if (guard := current()) is not None:
        guard.begin()
