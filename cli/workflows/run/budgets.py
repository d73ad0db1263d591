"""Budgets of the settings of a run, which only `--check` applies."""

from __future__ import annotations

from collections.abc import Iterable

from cli.errors import UsageError
from cli.workflows import check_config
from cli.workflows.run.recipe import RecipeBook


def has_budget(book: RecipeBook, outputs: Iterable[str]) -> bool:
    """Return whether the settings limit one of these outputs, named from their folder.

    Settings that `check` would refuse have no budgets: they are no fault of a run that does not check.
    """
    try:
        config = check_config.read_config(str(book.path))
    except UsageError:
        return False
    return bool(config.budgets) and any(config.budget_of(book.folder / name) for name in outputs)
