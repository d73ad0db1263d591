"""Record of the outputs that earlier runs have written."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, NamedTuple

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


class RecordedOutput(NamedTuple):
    """An output as it was written. input: of its job. settings: name of the file with the recipe."""

    input: str
    stamp: Stamp
    settings: str


@dataclass(frozen=True)
class OutputRecord:
    """Outputs that runs of one folder have written. path: of the record, shared by several such folders.

    settings: name of the settings file of this run, in the folder. outputs: by name. One that was changed since is no
    longer theirs. unsaved: those that only the journal of the last run has, as after it was ended.
    """

    path: Path
    folder: Path
    settings: str
    outputs: Mapping[str, RecordedOutput]
    unsaved: Mapping[str, RecordedOutput] = field(default_factory=dict)

    def is_unchanged(self, name: str) -> bool:
        """Return whether a file is an output as it was written."""
        return name in self.outputs and stamp_of(self.folder / name) == self.outputs[name].stamp

    def is_product(self, name: str, recipes: Iterable[Recipe]) -> bool:
        """Return whether a file is an unchanged output of recipes, from an input that may be deleted by now."""
        if not self.is_unchanged(name):
            return False
        source = self.outputs[name].input
        return any(matches(source, each.match) and each.output_of(source) == name for each in recipes)

    def save(self, written: Mapping[str, str], forgotten: Collection[str] = ()) -> None:
        """Add outputs, each with its input, and unsaved ones to the record as it is now, and remove some.

        Raises OutputError. Another run may have added its own since this record was read.
        """
        stamps = ((name, source, stamp_of(self.folder / name)) for name, source in written.items())
        new = {
            name: RecordedOutput(source, stamp, self.settings) for name, source, stamp in stamps if stamp is not None
        }
        with lock_folder(self.path.parent):
            folders = _read(self.path)
            known = _outputs_of(folders, self.folder)
            kept = {
                name: each for name, each in sorted({**known, **self.unsaved, **new}.items()) if name not in forgotten
            }
            if kept != known:
                text = json.dumps({"schema": SCHEMA, "folders": {**folders, str(self.folder): kept}}) + "\n"
                own_files.write(self.path.parent, self.path, np.frombuffer(text.encode(), np.uint8))


def read_outputs(path: Path, settings: Path, last: Entries) -> OutputRecord:
    """Return the record of the folder of a settings file; an empty one without a readable file.

    last: journal of the last run, which may have ended before it could save its outputs; those that were changed since,
    and of another folder with the same cache, are left out. Raises OutputError for a link, which `save` doesn't write
    through.
    """
    own_files.check_links(path.parent, path)
    folder = settings.parent
    outputs = _outputs_of(_read(path), folder)
    unsaved: dict[str, RecordedOutput] = {}
    for entry in last.values():
        name, stamp = entry.output, entry.output_stamp
        if stamp is None or not _is_output_name(name):
            continue
        found = RecordedOutput(entry.input, stamp, entry.settings)
        if outputs.get(name) != found and stamp_of(folder / name) == stamp:
            outputs[name] = unsaved[name] = found
    return OutputRecord(path, folder, settings.name, outputs, unsaved)


def _outputs_of(folders: Mapping[str, Any], folder: Path) -> dict[str, RecordedOutput]:
    """The outputs of a folder of settings, without entries of wrong types."""
    outputs: dict[str, RecordedOutput] = {}
    known = folders.get(str(folder), {})
    for name, value in known.items() if isinstance(known, dict) else ():
        with suppress(ValueError, TypeError):
            source, stamp, settings = value
            if _is_output_name(name) and isinstance(source, str) and isinstance(settings, str):
                outputs[name] = RecordedOutput(source, parse_stamp(stamp), settings)
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
