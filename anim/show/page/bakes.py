"""A page of a bake and its source: meshes that correspond, and those of the source that the bake lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from anim.gltf.document import json_array
from anim.model import MeshInstance, Scene
from anim.show.page.page import PageContent, PageFile, PageLink, PagePanel, PageRow
from anim.show.page.paired_meshes import PairedMeshes
from anim.units import plural

MAX_ROWS = 50  # meshes listed


def bake_content(source: PageFile, meshes: PairedMeshes, partners: Mapping[int, int], *, is_first: bool) -> PageContent:
    """Return the content of a page of a bake and its source, of which only the meshes in the bake are shown.

    meshes: nodes of the first and of the second file, as `pair_cache_meshes` returns them. is_first: whether the source
    is the first file.
    """
    hidden = _left_out(source, meshes[0 if is_first else 1])
    both = (hidden, ()) if is_first else ((), hidden)
    return PageContent(partners=dict(partners), meshes=meshes, hidden=both)


def left_out_instances(scene: Scene, content: PageContent) -> list[MeshInstance]:
    """Return the meshes of the source that a page of a bake does not show."""
    hidden = {node for nodes in content.hidden for node in nodes}
    return [each for each in scene.instances if each.node in hidden and len(each.mesh.positions)]


def with_left_out(content: PageContent, scene: Scene, about: str, *, clips: int = 0) -> PageContent:
    """Return the content of a page of a bake with a panel of the meshes, and the number of clips, that are not in it.

    scene: of the source. about: a sentence above the meshes. Links are those of the source, so only of a first file.
    """
    found = left_out_instances(scene, content)
    if not found and not clips:
        return content
    is_linked = bool(content.hidden[0])
    rows = [_row(scene, each, is_linked=is_linked) for each in found[:MAX_ROWS]]
    if len(found) > MAX_ROWS:
        rows.append(PageRow((f"{len(found) - MAX_ROWS} more",)))
    if clips:
        rows.append(PageRow((plural(clips, "other clip"),)))
    panel = PagePanel("Not in the bake", tuple(rows), about=about if found else "")
    return replace(content, panels=(*content.panels, panel))


def _left_out(file: PageFile, nodes: tuple[int, ...] | None) -> tuple[int, ...]:
    """Nodes with meshes that a bake of `nodes` lacks; none of a cache, and where nothing is paired."""
    if not nodes:
        return ()
    return tuple(
        i for i, each in enumerate(json_array(file.document.json, "nodes")) if "mesh" in each and i not in nodes
    )


def _row(scene: Scene, instance: MeshInstance, *, is_linked: bool) -> PageRow:
    cells = (scene.skeleton.display_name(instance.node), plural(len(instance.mesh.positions), "vertex", "vertices"))
    return PageRow(cells, PageLink(node=instance.node) if is_linked else None)
