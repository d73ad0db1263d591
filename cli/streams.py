"""Streams of a step of a recipe: bytes in memory instead of stdin, stdout and stderr."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # messages need no numpy
    from anim.arrays import Bytes


class StepStreams:
    """Bytes and lines that one step reads and writes.

    name: of the input, for messages. input: stdin. folder: of relative paths. cores: number of processes that the step
    may use, 0 for all. images: folder of the images that `input` names, None for the first step. output, messages:
    bytes on stdout and lines on stderr. error: the largest one that the step measured, in words; "" of one that
    measures none. files: read by name, also by the step's options, in order.
    """

    def __init__(self, name: str, input: Bytes, folder: Path, cores: int = 0, images: Path | None = None) -> None:
        self.name = name
        self.input = input
        self.folder = folder
        self.cores = cores
        self.images = images
        self.output: list[bytes] = []
        self.messages: list[str] = []
        self.error = ""
        self.files: list[Path] = []


_streams: ContextVar[StepStreams | None] = ContextVar("streams", default=None)


def step_streams() -> StepStreams | None:
    """Return the streams of the running step; None in a command of its own, which has those of the process."""
    return _streams.get()


@contextmanager
def use_streams(streams: StepStreams) -> Iterator[StepStreams]:
    """Run the block as a step with these streams."""
    token = _streams.set(streams)
    try:
        yield streams
    finally:
        _streams.reset(token)


def state_error(words: str) -> None:
    """Keep the error that a step measured, for the report of all steps."""
    if (step := _streams.get()) is not None:
        step.error = words


def locate(path: str) -> str:
    """Return the path of an input file: in a step, relative ones are in its folder."""
    step = _streams.get()
    return path if step is None or not path else str(step.folder / path)


def record_files(*paths: Path) -> None:
    """Keep the names of files that a step read, for its cache."""
    if (step := _streams.get()) is not None:
        step.files += paths
