"""Folders of outputs: made for names that are filled in, and there already for those written in full.

A slip in a name that somebody writes makes no folder, as with other tools; names with {path}, {clip} and the like, and
outputs of recipes, follow the inputs, whose folders nobody makes one by one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from anim.errors import OutputError, not_written

HELP = "make it first: only folders of names with {clip}, {path} and the like, and of -o FOLDER/ are made"


def check_missing(path: str, folder: Path, *, is_made: bool) -> None:
    """Raise OutputError for a folder that isn't there, unless it `is_made` for the output `path`, and can be."""
    if not is_made:
        raise OutputError(f"{path}: there is no folder '{folder}'", help=HELP)
    above = next((each for each in (folder, *folder.parents) if each.exists()), None)
    if above is None:  # as on a drive of Windows that isn't there
        raise OutputError(f"{path}: there is no '{folder.anchor or folder}'")
    if not above.is_dir():
        raise OutputError(f"{path}: '{above}' is no folder")
    if not os.access(above, os.W_OK):
        raise OutputError(f"{path}: can't be written (no permission to make a folder in '{above}')")


@contextmanager
def make_folder(path: str, *, needed: bool) -> Iterator[None]:
    """Make the folder of a file if it is `needed`; remove what was made, while empty, if the file isn't written."""
    folder = Path(path).parent
    missing = [each for each in (folder, *folder.parents) if needed and not each.exists()]
    try:
        if needed:
            folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise not_written(str(folder), error) from None
    try:
        yield
    except BaseException:
        with suppress(OSError):  # another file is there, or somebody else's
            for each in missing:
                each.rmdir()
        raise
