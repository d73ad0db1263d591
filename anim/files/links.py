"""Links to files: resolved once, at the start, so that a file and all that belongs beside it come from one folder."""

from __future__ import annotations

import os
from pathlib import Path


def resolve_links(path: Path) -> Path:
    """Return where the file lies that a link leads to, also one that is not there yet; any other path as it is.

    A link to what has no place in a folder (/dev/stdin, which may be a pipe) stays as it is, too.
    followed(s/q.gltf → ../real/q.gltf) → /…/real/q.gltf
    """
    if not os.path.islink(path):
        return path
    real = os.path.realpath(path)
    return path if os.path.exists(path) and not os.path.exists(real) else Path(real)
