"""Advice on pages: commands that name the page's file."""

from __future__ import annotations

import pytest

from cli.reports.page_panels import advice_for


@pytest.mark.parametrize(
    ("file", "names"),
    [
        ("models/walk.glb", "walk.glb walk-new.glb"),
        ("-odd.glb", "./-odd.glb ./-odd-new.glb"),
        ("a b.glb", "'a b.glb' 'a b-new.glb'"),
    ],
)
def test_advice_names_the_file(file: str, names: str) -> None:
    assert advice_for(file, "gltf-anim trim IN OUT --rebase") == f"gltf-anim trim {names} --rebase"
