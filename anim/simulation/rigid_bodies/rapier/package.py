"""Import of the optional package rapier3d."""

from __future__ import annotations

from typing import Any

from anim.errors import UnsupportedError


def load_package() -> Any:
    """Return the module rapier3d. Raises UnsupportedError where it isn't installed."""
    try:
        import rapier3d
    except ImportError:
        problem = "rigid bodies need the package rapier3d"
        raise UnsupportedError(problem, help="pip install 'gltf-anim[physics]'") from None
    return rapier3d
