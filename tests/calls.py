"""Counting calls of functions: work that no other process changes."""

from __future__ import annotations

import pytest


def count_calls(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> list[None]:
    """Count the calls of a function from now on, in a list that grows with each."""
    counted: list[None] = []
    function = getattr(owner, name)

    def called(*args: object, **options: object) -> object:
        counted.append(None)
        return function(*args, **options)

    monkeypatch.setattr(owner, name, called)
    return counted
