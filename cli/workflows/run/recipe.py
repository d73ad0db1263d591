"""Recipes: [[recipe]] of the settings, each with the pattern of its files, its steps, and the name of its output."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from cli.errors import UsageError
from cli.io import output_names
from cli.workflows import config_tables
from cli.workflows.run.steps import Step, parse_step

_KEYS: config_tables.Keys = {"name": str, "match": str, "steps": list, "out": str}


@dataclass(frozen=True)
class Recipe:
    """Steps for the files that match a pattern. out: name of the output, with `output_names.OF_PATHS` in braces.

    match and out are relative to the folder of the settings, and use "/".
    """

    name: str
    match: str
    steps: tuple[Step, ...]
    out: str

    def output_of(self, path: str) -> str:
        """Return the output of a file. path: from the folder of the settings.

        Recipe("", "", (), "build/{folder}/{stem}.gltf").output_of("crowd/a.glb") → "build/crowd/a.gltf"
        """
        return output_names.fill_path(self.out, path)


@dataclass(frozen=True)
class RecipeBook:
    """Recipes of one settings file, and its folder."""

    path: Path
    recipes: tuple[Recipe, ...]

    @property
    def folder(self) -> Path:
        """Folder of the settings, from which all names count."""
        return self.path.parent


def read_recipes(config: str | None) -> RecipeBook:
    """Return the recipes of a settings file, or of the nearest one from the working folder upwards. Raises UsageError.

    All steps are parsed: an unknown command or option is refused here.
    """
    found = config_tables.find_table(Path.cwd()) if config is None else (Path(config), config_tables.read_table(config))
    if found is None:
        raise UsageError(
            f"there is no {config_tables.NAME} here or in a folder above", help="write one with [[recipe]]: run --help"
        )
    path, table = found
    config_tables.check_keys(path, "", table, config_tables.SECTIONS)
    entries = table.get("recipe", [])
    if not entries:
        raise UsageError(f"{path}: has no [[recipe]]", help="run --help shows one")
    recipes = tuple(_recipe(path, entry, number) for number, entry in enumerate(entries, 1))
    names = [each.name for each in recipes]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise UsageError(f"{path}: two recipes are called '{twice}'")
    return RecipeBook(path.resolve(), recipes)


def _recipe(path: Path, entry: Any, number: int) -> Recipe:
    config_tables.check_keys(path, "recipe", entry, _KEYS)
    where = _label(path, entry, number)
    _check_complete(where, entry)
    output_names.check_placeholders(entry["out"], output_names.OF_PATHS)
    steps = [_step(words, number, f"{where}: step {number}") for number, words in enumerate(entry["steps"], 1)]
    return Recipe(entry.get("name", str(number)), entry["match"], tuple(steps), entry["out"])


def _label(path: Path, entry: Mapping[str, Any], number: int) -> str:
    return f"{path}: recipe '{entry['name']}'" if entry.get("name") else f"{path}: recipe {number}"


def _check_complete(where: str, entry: Mapping[str, Any]) -> None:
    for key in ("match", "steps", "out"):
        if not entry.get(key):
            raise UsageError(f"{where}: has no {key}")
    for key in ("match", "out"):
        if "\0" in entry[key]:
            raise UsageError(f"{where}: {key} has a null character (no file name has one)")
        if PurePosixPath(entry[key]).is_absolute() or ".." in PurePosixPath(entry[key]).parts:
            problem = f"{key} is '{entry[key]}' (expected a path below the folder of the settings)"
            raise UsageError(f"{where}: {problem}")


def _step(words: Any, number: int, where: str) -> Step:
    if not isinstance(words, str):
        raise UsageError(f'{where} is no text (expected a command line, like "resample --fps 30")')
    if "\0" in words:
        raise UsageError(f"{where} has a null character (no command line has one)")
    try:
        return parse_step(words, is_first=number == 1)
    except UsageError as error:
        raise UsageError(f"{where}: {error}", help=error.help) from None


def chosen_recipes(book: RecipeBook, names: Sequence[str]) -> tuple[Recipe, ...]:
    """Return the recipes of these names, all without any. Raises UsageError for an unknown name."""
    known = {each.name: each for each in book.recipes}
    for name in names:
        if name not in known:
            raise UsageError(f"there is no recipe '{name}' in {book.path}", help=f"recipes: {', '.join(known)}")
    return tuple(known[name] for name in names) or book.recipes
