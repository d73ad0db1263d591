"""Stale outputs: those of earlier runs that no recipe makes any more, as after an input was deleted."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from anim.errors import AnimError
from anim.gltf.io import gltf_files
from anim.gltf.io.source import external_files, open_file
from anim.units import list_some, plural
from cli.errors import UsageError
from cli.text import Reporter
from cli.workflows import check_config
from cli.workflows.run.job import Job, is_text
from cli.workflows.run.outputs import OutputRecord, WrittenFiles
from cli.workflows.run.recipe import RecipeBook
from cli.workflows.run.stale_images import StaleImages

MAX_LISTED_OUTPUTS = 3  # in a note


def report_stale(
    record: OutputRecord,
    book: RecipeBook,
    jobs: Sequence[Job],
    written: WrittenFiles,
    reporter: Reporter,
    *,
    delete: bool,
) -> None:
    """Name the stale outputs, or delete them, after a run of all files and recipes; save the record.

    written: outputs of this run.
    Without any job none is deleted whose input is still there: a pattern is likely to be mistyped.
    Raises OutputError, and UsageError for settings of budgets that are wrong.
    """
    stale, changed = find_stale(record, book, jobs)
    is_doubtful = delete and not jobs and any((record.folder / record.outputs[name].input).exists() for name in stale)
    delete = delete and not is_doubtful
    record.save(written)
    images = _delete(record, stale, written.inputs, list(_files_read(book, jobs))) if delete and stale else []
    if stale:
        names = list_some(stale, MAX_LISTED_OUTPUTS)
        beside = f", with {plural(len(images), 'image')}" if images else ""
        what = f"deleted{beside}" if delete else "--delete-stale deletes them"
        what = "not deleted, since their inputs are still there" if is_doubtful else what
        reporter.info(
            f"note: no recipe makes {plural(len(stale), 'output')} of earlier runs any more ({names}): {what}"
        )
    if changed and delete:
        names = list_some(changed, MAX_LISTED_OUTPUTS)
        reporter.info(
            f"note: no recipe makes {plural(len(changed), 'output')} that changed after its run ({names}): not deleted"
        )


def find_stale(record: OutputRecord, book: RecipeBook, jobs: Sequence[Job]) -> tuple[list[str], list[str]]:
    """Return the outputs of earlier runs that no job makes and that nothing here reads: unchanged and changed, sorted.

    Those of other settings that are in the folder are left alone, whose recipes may make them; so are links, and files
    behind a link, which may be somebody else's.
    """
    outputs = {job.output for job in jobs}
    own = {name for name, each in record.outputs.items() if record.is_own(each)}
    found = [name for name in sorted(own - outputs) if _is_plain(record.folder, name)]
    if not found:
        return [], []
    needed = {_identity(record.folder / name) for name in (*outputs, *_files_read(book, jobs))}
    unused = [name for name in found if _identity(record.folder / name) not in needed]
    return list(filter(record.is_whole, unused)), [each for each in unused if not record.is_whole(each)]


def _files_read(book: RecipeBook, jobs: Iterable[Job]) -> Iterator[str]:
    """Yield the files that runs and checks read: inputs, files of all steps, and sources of budgets."""
    yield from (job.input for job in jobs)
    yield from (name for recipe in book.recipes for step in recipe.steps for name in step.files)
    config = check_config.read_config(str(book.path))
    yield from (each.against for each in config.budgets if each.against and "{" not in each.against)
    for job in jobs if config.budgets else ():
        path = book.folder / job.output
        budget = config.budget_of(path)
        if budget is not None and budget.against:
            with suppress(UsageError):  # the output itself
                yield str(config.source_of(path, budget))


def _is_plain(folder: Path, name: str) -> bool:
    """Return whether a name is that of a regular file below the folder, with no link on its way."""
    path = folder / name
    try:
        return stat.S_ISREG(path.lstat().st_mode) and path.resolve() == folder.resolve() / name
    except (OSError, ValueError):
        return False


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and number of a file, equal for all its names; None without one."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino


def _delete(record: OutputRecord, names: Sequence[str], written: Iterable[str], read: Sequence[str]) -> list[str]:
    """Delete outputs, with buffers and images that nothing else uses, and folders that become empty.

    written: outputs of this run. read: files whose buffers and images remain. Returns the images. Raises OutputError.
    """
    folder, images = record.folder, StaleImages(record, names)
    spared = list(_buffers(folder, read)) if any(map(is_text, names)) else []
    deleted: list[str] = []
    try:
        gltf_files.remove([folder / name for name in names], spared)
        deleted = images.delete((*(record.outputs.keys() - names), *written, *read))
    finally:
        for name in (*names, *deleted):
            with suppress(OSError):  # not empty
                for above in (folder / name).relative_to(folder).parents[:-1]:
                    (folder / above).rmdir()
    record.forget([*names, *deleted])
    return deleted


def _buffers(folder: Path, names: Iterable[str]) -> Iterator[Path]:
    for name in filter(is_text, names):
        with suppress(AnimError):
            yield from external_files(open_file(str(folder / name)))
