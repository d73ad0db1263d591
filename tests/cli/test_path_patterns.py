"""Patterns of paths in settings."""

from __future__ import annotations

from itertools import product

import pytest

from cli.io.path_patterns import can_match_below, matches


@pytest.mark.parametrize(
    ("pattern", "path", "is_match"),
    [
        ("**", "a.glb", True),
        ("**/*.glb", "a.glb", True),
        ("**/*.glb", "a/b/c.glb", True),
        ("**/b/**/*.glb", "a/b/c/d.glb", True),
        ("**/b/**/*.glb", "b/d.glb", True),
        ("**/b/**/*.glb", "a/d.glb", False),
        ("a/**", "a/b/c.glb", True),
        ("a/**", "b/c.glb", False),
        ("*/*", "a/b.glb", True),
        ("*/*", "a/b/c.glb", False),
        ("*", "a/b.glb", False),
        ("[ab]?.glb", "b1.glb", True),
        ("*.glb", "A.GLB", False),
        ("/".join(["**"] * 12) + "/zz.glb", "d/" * 18 + "a.glb", False),
        ("/".join(["**/*"] * 9) + "/a.glb", "d/" * 30 + "a.glb", True),
        ("/".join(["**/d"] * 12) + "/zz.glb", "d/" * 30 + "a.glb", False),
        ("*d" * 20 + ".glb", "d" * 250, False),
    ],
)
def test_patterns(pattern: str, path: str, is_match: bool) -> None:
    """Patterns of many ** took minutes."""
    assert matches(path, pattern) == is_match


def test_folders_are_left_out_exactly_if_no_path_below_them_matches() -> None:
    """All patterns of up to three parts, and all paths of up to five."""
    paths = ["/".join(parts) for n in range(1, 6) for parts in product("ab", repeat=n)]
    for pattern in ("/".join(parts) for n in range(1, 4) for parts in product(("a", "*", "**"), repeat=n)):
        found = [path for path in paths if matches(path, pattern)]
        for folder in ("", *(path for path in paths if path.count("/") < 2)):
            below = f"{folder}/" if folder else ""
            assert can_match_below(folder, pattern) == any(path.startswith(below) for path in found), (folder, pattern)
