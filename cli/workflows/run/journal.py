"""Journal of a run: a JSON line for each file when it is done, so that an interrupted run can be resumed."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from anim import __version__
from anim.files.stream import write_stream
from cli.workflows.run import own_files
from cli.workflows.run.stamps import Stamp, is_size, parse_stamp, stamp_files, stamp_of

NAME = "journal.jsonl"
STATUSES = MADE, CACHED, DONE_BEFORE, FAILED = "made", "cached", "done before", "failed"


@dataclass(frozen=True)
class JournalEntry:
    """One file. recipe: hash of its steps. stamps: size and modification time of input and output.

    files: stamps by path of the other files that were read and written, such as buffers and images; None in a journal
    of an earlier version. size: bytes of the output with its buffers.
    status: MADE, CACHED, DONE_BEFORE (in an earlier run that is resumed) or FAILED.
    messages: of failed files, else warnings and notes. copies: images that were copied beside the output.
    settings: name of the settings file; "" in an earlier version. buffers: stamps by path of the output's own.
    """

    input: str
    output: str
    recipe: str
    status: str
    code: int = 0
    seconds: float = 0.0
    size: int = 0
    input_stamp: Stamp | None = None
    output_stamp: Stamp | None = None
    files: dict[str, Stamp | None] | None = None
    messages: tuple[str, ...] = ()
    copies: tuple[str, ...] = ()
    settings: str = ""
    buffers: dict[str, Stamp] = field(default_factory=dict)


Entries: TypeAlias = Mapping[tuple[str, str], JournalEntry]  # the last ones, by input and output


@dataclass
class Journal:
    """Journal that a run writes; a line is complete in the file as soon as it is written.

    file: None of a run that keeps no journal. settings: name of the settings file. earlier: entries of the run that is
    resumed.
    """

    path: Path
    file: io.FileIO | None
    settings: str
    earlier: Entries

    def write(self, entry: JournalEntry) -> None:
        """Append a line."""
        self.write_line({**asdict(entry), "settings": self.settings})

    def write_line(self, value: dict[str, Any]) -> None:
        """Append a JSON object as a line. Raises OutputError."""
        if self.file is None:
            return
        line = json.dumps(value, ensure_ascii=False) + "\n"
        write_stream(self.file, [line.encode(errors="backslashreplace")], str(self.path))

    def find_done(self, folder: Path, input: str, output: str, recipe: str) -> JournalEntry | None:
        """Return the entry of an earlier run that made an output by these steps, if no file has changed since."""
        entry = self.earlier.get((input, output))
        if entry is None or entry.status == FAILED or entry.recipe != recipe or entry.output_stamp is None:
            return None
        stamps = stamp_of(folder / input), stamp_of(folder / output)
        if stamps != (entry.input_stamp, entry.output_stamp) or entry.files is None:
            return None
        return entry if stamp_files(folder, entry.files) == entry.files else None


@contextmanager
def open_journal(path: Path, settings: str, files: int, last: Entries, *, resume: bool) -> Iterator[Journal]:
    """Open the journal of a run. Raises OutputError.

    resume: append to that of the last run, with its entries, else begin a new one; while another run writes there, both
    have one.
    """
    with own_files.open_for_lines(path, append=resume) as file:
        journal = Journal(path, file, settings, last if resume else {})
        if resume:
            write_stream(file, [b"\n"], str(path))  # ends a line that was cut off
        journal.write_line({"run": {"version": __version__, "files": files, "resumed": resume}})
        yield journal


def read_journal(path: Path) -> Entries:
    """Return the last entry of each input and output; none without a journal. Lines that are cut off are skipped."""
    entries: dict[tuple[str, str], JournalEntry] = {}
    try:
        lines = own_files.read(path).decode(errors="replace").split("\n")
    except OSError:
        return entries
    for line in lines:
        with suppress(ValueError, TypeError, AttributeError, LookupError, OverflowError, RecursionError):
            entry = _entry(json.loads(line))
            entries[entry.input, entry.output] = entry
    return entries


def _entry(value: dict[str, Any]) -> JournalEntry:
    """The entry of a line. Raises TypeError for values of other types: somebody else may have written the journal."""
    parsed: dict[str, Any] = {key: _stamp(value[key]) for key in ("input_stamp", "output_stamp") if key in value}
    if value.get("files") is not None:
        parsed["files"] = {path: _stamp(stamp) for path, stamp in value["files"].items()}
    parsed["buffers"] = {path: parse_stamp(stamp) for path, stamp in value.get("buffers", {}).items()}
    messages, copies = value.get("messages", []), value.get("copies", [])
    texts = [*(value[key] for key in ("input", "output", "recipe", "status")), value.get("settings", "")]
    are_lists = isinstance(messages, list) and isinstance(copies, list)
    if not are_lists or not all(isinstance(each, str) for each in [*texts, *messages, *copies]):
        raise TypeError("is no entry of a journal")
    if not is_size(value.get("size", 0)) or type(value.get("code", 0)) is not int:
        raise TypeError("has no size or code")
    return JournalEntry(**{**value, **parsed, "messages": tuple(messages), "copies": tuple(copies)})


def _stamp(value: Any) -> Stamp | None:
    return None if value is None else parse_stamp(value)
