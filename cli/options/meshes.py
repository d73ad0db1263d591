"""Options on meshes: selection, and skinning method."""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Annotated

import typer

from anim.exchange.retarget.ground_contact import with_descendants
from anim.model import Scene
from anim.operations.selection import match_names, not_found
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
    """Return the nodes of the selected meshes, by the name of mesh or node, or "#3" by the node; None for all.

    Raises NotFoundError for a glob that matches none.
    """
    if not globs:
        return None
    chosen = set[int]().union(*(_nodes_of(scene, glob) for glob in globs))
    return [each.node for each in scene.instances if each.node in chosen]


def _nodes_of(scene: Scene, glob: str) -> set[int]:
    """Nodes of the meshes that a glob selects; "#3" or "3" is the node of this index, unless that is a name."""
    stated = [each.mesh.name for each in scene.instances]
    stated += [scene.skeleton.names[each.node] for each in scene.instances]
    names = [name or f"#{scene.instances[i % len(scene.instances)].node}" for i, name in enumerate(stated)]
    index = re.fullmatch(r"#?([0-9]{1,9})", glob)
    if index is None or glob in stated:
        return {scene.instances[i % len(scene.instances)].node for i in match_names([glob], names, "mesh")}
    found = {each.node for each in scene.instances if each.node == int(index[1])}
    if not found:
        raise not_found(glob, names, "mesh")
    return found


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
