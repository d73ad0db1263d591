"""Options on meshes: selection, and skinning method."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from anim.exchange.retarget.ground_contact import with_descendants
from anim.model import Scene
from anim.operations.selection import match_names
from anim.skinning.methods.registry import SKINNING_METHODS

Meshes = Annotated[
    list[str] | None,
    typer.Option(
        "--mesh", metavar="GLOB", help="Only meshes with this name, or of nodes with this name; may be repeated."
    ),
]

Hidden = Annotated[
    list[str] | None,
    typer.Option(
        "--hide",
        metavar="GLOB",
        help="Hide meshes with this name, and all meshes at or below nodes with this name; may be repeated.",
    ),
]
Method = StrEnum("Method", [(name, name) for name in SKINNING_METHODS])  # type: ignore[misc]
ABOUT = "; ".join(f"{name}: {method.about}" for name, method in SKINNING_METHODS.items()) + "."


def nodes(scene: Scene, globs: list[str] | None) -> list[int] | None:
    """Return the nodes of the selected meshes, by the name of mesh or node; None for all.

    Raises NotFoundError for a glob that matches none.
    """
    if not globs:
        return None
    meshes = [each.mesh.name or str(each.node) for each in scene.instances]
    nodes = [scene.skeleton.names[each.node] or str(each.node) for each in scene.instances]
    return [scene.instances[i % len(meshes)].node for i in match_names(globs, [*meshes, *nodes], "mesh")]


def visible_meshes(scene: Scene, globs: list[str] | None, hidden: list[str] | None) -> list[int] | None:
    """Return the nodes of the selected meshes without the hidden ones; None for all.

    hidden: globs for names of meshes and of nodes; a node hides its descendants too.
    Raises NotFoundError for a glob that matches none.
    """
    chosen = nodes(scene, globs)
    if not hidden:
        return chosen
    names = [name or str(i) for i, name in enumerate(scene.skeleton.names)]
    meshes = [each.mesh.name or str(each.node) for each in scene.instances]
    found = match_names(hidden, [*names, *meshes], "mesh or node")
    above = {i for i in found if i < len(names)}
    gone = {scene.instances[i - len(names)].node for i in found if i >= len(names)}
    gone.update(with_descendants(scene.skeleton, above).tolist())
    kept = [each.node for each in scene.instances] if chosen is None else chosen
    return [node for node in kept if node not in gone]
