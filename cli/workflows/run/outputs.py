"""Record of the outputs that earlier runs have written."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, NamedTuple, TypeVar

import numpy as np

from anim.files.folder_lock import lock_folder
from anim.gltf.io import images
from anim.gltf.io.container import SUFFIXES
from cli.io.path_patterns import matches
from cli.workflows.run import own_files
from cli.workflows.run.journal import Entries
from cli.workflows.run.output_stamps import OutputStamps, are_unchanged
from cli.workflows.run.recipe import Recipe
from cli.workflows.run.stamps import Stamp, parse_stamp, stamp_of

NAME = "outputs.json"  # in the folder of the cache
SCHEMA = 1
FOLDERS, COPIES = "folders", "copies"  # parts of the record: outputs and images, by folder of settings

T = TypeVar("T")


class RecordedOutput(NamedTuple):
    """An output as it was written. input: of its job. settings: name of the file with the recipe.

    buffers: stamps of its buffers by name; none in records of earlier versions.
    """

    input: str
    stamp: Stamp
    settings: str
    buffers: Mapping[str, Stamp]


@dataclass
class WrittenFiles:
    """Files of a run, from the folder of the settings.

    inputs: by output, of those that are complete. stamps: of these when each was written, and copies of the images that
    were copied beside them. Who edits one while others are made has changed it: its stamp at the end is no output's.
    """

    inputs: dict[str, str] = field(default_factory=dict)
    stamps: dict[str, OutputStamps] = field(default_factory=dict)
    copies: dict[str, Stamp] = field(default_factory=dict)

    def add(self, output: str, input: str, stamps: OutputStamps | None) -> None:
        """Add an output with its stamps; None if it is gone already."""
        self.inputs[output] = input
        if stamps is not None:
            self.stamps[output] = stamps
            self.copies |= stamps.copies


@dataclass(frozen=True)
class OutputRecord:
    """Outputs that runs of one folder have written. path: of the record, shared by several such folders.

    settings: name of the settings file of this run, in the folder. outputs: by name. One that was changed since is no
    longer theirs. copies: size and modification time of images that were copied beside outputs. unsaved,
    unsaved_copies: those that only the journal of the last run has, as after it was ended.
    """

    path: Path
    folder: Path
    settings: str
    outputs: Mapping[str, RecordedOutput]
    copies: Mapping[str, Stamp] = field(default_factory=dict)
    unsaved: Mapping[str, RecordedOutput] = field(default_factory=dict)
    unsaved_copies: Mapping[str, Stamp] = field(default_factory=dict)

    def is_unchanged(self, name: str) -> bool:
        """Return whether a file is an output as it was written."""
        return name in self.outputs and stamp_of(self.folder / name) == self.outputs[name].stamp

    def is_whole(self, name: str) -> bool:
        """Return whether an output is as it was written, with its buffers."""
        return self.is_unchanged(name) and are_unchanged(self.folder, self.outputs[name].buffers)

    def is_unchanged_copy(self, name: str) -> bool:
        """Return whether a file is an image as it was copied."""
        return name in self.copies and stamp_of(self.folder / name) == self.copies[name]

    def is_product(self, name: str, recipes: Iterable[Recipe]) -> bool:
        """Return whether a file is an unchanged output of recipes, from an input that may be deleted by now."""
        if not self.is_unchanged(name):
            return False
        source = self.outputs[name].input
        return any(matches(source, each.match) and each.output_of(source) == name for each in recipes)

    def is_own(self, output: RecordedOutput) -> bool:
        """Return whether the settings of this run made an output, or some that are no longer in the folder."""
        name = output.settings
        return name == self.settings or bool(name and not (self.folder / name).exists())

    def save(self, written: WrittenFiles) -> None:
        """Add outputs, images and unsaved ones to the record as it is now.

        Another run may have added its own since this record was read. Raises OutputError.
        """
        new = {
            name: RecordedOutput(written.inputs[name], stamps.output, self.settings, stamps.buffers)
            for name, stamps in written.stamps.items()
        }
        self._update({**self.unsaved, **new}, {**self.unsaved_copies, **written.copies})

    def forget(self, names: Collection[str]) -> None:
        """Remove outputs and images from the record as it is now. Raises OutputError."""
        self._update({}, {}, names)

    def _update(
        self, outputs: Mapping[str, RecordedOutput], copies: Mapping[str, Stamp], forgotten: Collection[str] = ()
    ) -> None:
        with lock_folder(self.path.parent):
            content = _read(self.path)
            known, before = _outputs_of(content, self.folder), _copies_of(content, self.folder)
            new = {name: each for name, each in outputs.items() if not self._is_rewritten(name, known.get(name), each)}
            kept, left = _without({**known, **new}, forgotten), _without({**before, **copies}, forgotten)
            if (kept, left) != (known, before):
                folders = {**content.get(FOLDERS, {}), str(self.folder): kept}
                others = {**content.get(COPIES, {}), str(self.folder): left}
                text = json.dumps({"schema": SCHEMA, FOLDERS: folders, COPIES: others}) + "\n"
                own_files.write(self.path.parent, self.path, np.frombuffer(text.encode(), np.uint8))

    def _is_rewritten(self, name: str, known: RecordedOutput | None, new: RecordedOutput) -> bool:
        """Return whether another run has written an output again, and its record is the one that fits the file."""
        return known is not None and known.stamp != new.stamp and stamp_of(self.folder / name) == known.stamp

    def save_unsaved(self) -> None:
        """Add to the record what only the journal of the last run has. Raises OutputError."""
        if self.unsaved or self.unsaved_copies:
            self.save(WrittenFiles())


def read_outputs(path: Path, settings: Path, last: Entries) -> OutputRecord:
    """Return the record of the folder of a settings file; an empty one without a readable file.

    last: journal of the last run, which may have ended before it could save its outputs; those that were changed since,
    and of another folder with the same cache, are left out. Raises OutputError for a link, which `save` doesn't write
    through.
    """
    own_files.check_links(path.parent, path)
    folder, content = settings.parent, _read(path)
    outputs, copies = _outputs_of(content, folder), _copies_of(content, folder)
    unsaved: dict[str, RecordedOutput] = {}
    unsaved_copies = _copied(folder, last, copies)
    for entry in last.values():
        name, stamp = entry.output, entry.output_stamp
        if stamp is None or not _is_output_name(name):
            continue
        found = RecordedOutput(entry.input, stamp, entry.settings, entry.buffers)
        if outputs.get(name) != found and stamp_of(folder / name) == stamp:
            outputs[name] = unsaved[name] = found
    return OutputRecord(path, folder, settings.name, outputs, {**copies, **unsaved_copies}, unsaved, unsaved_copies)


def _copied(folder: Path, last: Entries, known: Mapping[str, Stamp]) -> dict[str, Stamp]:
    """The images that the last run copied, and that are unchanged, without known ones."""
    found = {name: (entry.files or {}).get(os.path.normpath(name)) for entry in last.values() for name in entry.copies}
    return {
        name: stamp
        for name, stamp in found.items()
        if stamp is not None and known.get(name) != stamp and _is_image_name(name) and stamp_of(folder / name) == stamp
    }


def _without(found: Mapping[str, T], names: Collection[str]) -> dict[str, T]:
    return {name: each for name, each in sorted(found.items()) if name not in names}


def _outputs_of(content: Mapping[str, Any], folder: Path) -> dict[str, RecordedOutput]:
    """The outputs of a folder of settings, without entries of wrong types."""
    outputs: dict[str, RecordedOutput] = {}
    for name, value in _entries(content, FOLDERS, folder):
        with suppress(ValueError, TypeError):
            source, stamp, settings, *more = value
            buffers = {key: parse_stamp(each) for key, each in dict(*more).items()}
            if _is_output_name(name) and isinstance(source, str) and isinstance(settings, str):
                outputs[name] = RecordedOutput(source, parse_stamp(stamp), settings, buffers)
    return outputs


def _copies_of(content: Mapping[str, Any], folder: Path) -> dict[str, Stamp]:
    """The copied images of a folder of settings, without entries of wrong types."""
    copies: dict[str, Stamp] = {}
    for name, value in _entries(content, COPIES, folder):
        with suppress(ValueError, TypeError):
            if _is_image_name(name):
                copies[name] = parse_stamp(value)
    return copies


def _entries(content: Mapping[str, Any], part: str, folder: Path) -> Iterable[tuple[str, Any]]:
    known = content.get(part, {}).get(str(folder), {})
    return known.items() if isinstance(known, dict) else ()


def _is_output_name(name: str) -> bool:
    """Return whether a recipe can have an output of this name: the record may be another's work."""
    return _is_inside(name, SUFFIXES)


def _is_image_name(name: str) -> bool:
    """Return whether an image can have been copied to this name."""
    return _is_inside(name, images.SUFFIXES)


def _is_inside(name: str, suffixes: Collection[str]) -> bool:
    path = PurePath(name)
    return not path.is_absolute() and ".." not in path.parts and path.suffix.lower() in suffixes


def _read(path: Path) -> dict[str, Any]:
    """Return the parts of the record that are objects, without others."""
    try:
        value = json.loads(own_files.read(path).decode(errors="surrogateescape"))
    except (OSError, ValueError, RecursionError):
        return {}
    parts = value if isinstance(value, dict) else {}
    return {part: parts[part] for part in (FOLDERS, COPIES) if isinstance(parts.get(part), dict)}
