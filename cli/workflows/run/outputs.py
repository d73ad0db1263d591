"""Record of the outputs that earlier runs have written."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from anim.files.folder_lock import lock_folder
from anim.gltf.io.container import SUFFIXES
from cli.workflows.check_config import matches
from cli.workflows.run import own_files
from cli.workflows.run.journal import Entries
from cli.workflows.run.recipe import Recipe
from cli.workflows.run.stamps import Stamp, parse_stamp, stamp_of

NAME = "outputs.json"  # in the folder of the cache
SCHEMA = 1


@dataclass(frozen=True)
class OutputRecord:
    """Outputs that runs of one folder of settings have written. path: of the record, shared by several such folders.

    outputs: input, and size and modification time, by output. One that was changed since is no longer theirs.
    unsaved: input by output, of those that only the journal of the last run has, as after it was ended.
    """

    path: Path
    folder: Path
    outputs: Mapping[str, tuple[str, Stamp]]
    unsaved: Mapping[str, str] = field(default_factory=dict)

    def is_unchanged(self, name: str) -> bool:
        """Return whether a file is an output as it was written."""
        return name in self.outputs and stamp_of(self.folder / name) == self.outputs[name][1]

    def is_product(self, name: str, recipes: Iterable[Recipe]) -> bool:
        """Return whether a file is an unchanged output of recipes, from an input that may be deleted by now."""
        if not self.is_unchanged(name):
            return False
        source = self.outputs[name][0]
        return any(matches(source, each.match) and each.output_of(source) == name for each in recipes)

    def save(self, written: Mapping[str, str], forgotten: Collection[str] = ()) -> None:
        """Add outputs, each with its input, to the record as it is now, and remove some. Raises OutputError.

        Another run may have added its own since this record was read.
        """
        stamps = ((name, source, stamp_of(self.folder / name)) for name, source in written.items())
        new = {name: (source, stamp) for name, source, stamp in stamps if stamp is not None}
        with lock_folder(self.path.parent):
            folders = _read(self.path)
            known = _outputs_of(folders, self.folder)
            kept = {name: each for name, each in sorted({**known, **new}.items()) if name not in forgotten}
            if kept != known:
                text = json.dumps({"schema": SCHEMA, "folders": {**folders, str(self.folder): kept}}) + "\n"
                own_files.write(self.path.parent, self.path, np.frombuffer(text.encode(), np.uint8))


def read_outputs(path: Path, folder: Path, last: Entries) -> OutputRecord:
    """Return the record of a folder of settings; an empty one without a readable file.

    last: journal of the last run, which may have ended before it could save its outputs; those that were changed since,
    and of another folder with the same cache, are left out. Raises OutputError for a link, which `save` doesn't write
    through.
    """
    own_files.check_links(path.parent, path)
    outputs = _outputs_of(_read(path), folder)
    unsaved: dict[str, str] = {}
    for entry in last.values():
        name, stamp = entry.output, entry.output_stamp
        if stamp is None or outputs.get(name) == (entry.input, stamp) or not _is_output_name(name):
            continue
        if stamp_of(folder / name) == stamp:
            outputs[name], unsaved[name] = (entry.input, stamp), entry.input
    return OutputRecord(path, folder, outputs, unsaved)


def _outputs_of(folders: Mapping[str, Any], folder: Path) -> dict[str, tuple[str, Stamp]]:
    """The outputs of a folder of settings, without entries of wrong types."""
    outputs: dict[str, tuple[str, Stamp]] = {}
    known = folders.get(str(folder), {})
    for name, value in known.items() if isinstance(known, dict) else ():
        with suppress(ValueError, TypeError):
            source, stamp = value
            if _is_output_name(name) and isinstance(source, str):
                outputs[name] = source, parse_stamp(stamp)
    return outputs


def _is_output_name(name: str) -> bool:
    """Return whether a recipe can have an output of this name: the record may be another's work."""
    path = PurePath(name)
    return not path.is_absolute() and ".." not in path.parts and path.suffix.lower() in SUFFIXES


def _read(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(own_files.read(path).decode(errors="surrogateescape"))
    except (OSError, ValueError, RecursionError):
        return {}
    folders = value.get("folders") if isinstance(value, dict) else None
    return folders if isinstance(folders, dict) else {}
