"""Which meshes of a scene a command is about: `--mesh GLOB`."""

from __future__ import annotations

from typing import Annotated

import typer

from anim.model import Scene
from anim.ops.selection import matching

Meshes = Annotated[
    list[str] | None,
    typer.Option("--mesh", metavar="GLOB", help="Only meshes of this name, or of their node's; may be repeated."),
]


def nodes(scene: Scene, globs: list[str] | None) -> list[int] | None:
    """Return the nodes of the meshes that are meant, by the mesh's name or the node's; None for all.

    Raises NotFoundError for a glob that matches none.
    """
    if not globs:
        return None
    meshes = [each.mesh.name or str(each.node) for each in scene.instances]
    nodes = [scene.skeleton.names[each.node] or str(each.node) for each in scene.instances]
    return [scene.instances[i % len(meshes)].node for i in matching(globs, [*meshes, *nodes], "mesh")]
