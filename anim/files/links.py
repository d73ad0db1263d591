"""Resolve links once at the start, so that a file and its companions have the same folder."""

from __future__ import annotations

import os
from pathlib import Path


def resolve_links(path: Path) -> Path:
    """Return the target of a link, existing or not; any other path unchanged.

    A link to a target outside the file system (/dev/stdin, which may be a pipe) is unchanged, too.
    resolve_links(s/q.gltf → ../real/q.gltf) → /…/real/q.gltf
    """
    if not os.path.islink(path):
        return path
    real = os.path.realpath(path)
    return path if os.path.exists(path) and not os.path.exists(real) else Path(real)
