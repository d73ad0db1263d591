"""Scenes of files, with warnings on everything that changes the meaning of measurements."""

from __future__ import annotations

from collections.abc import Callable, Collection

from anim.errors import AnimError
from anim.gltf.document import Document, node_label
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.node_constraints import CONSTRAINT, constrained_nodes
from anim.gltf.reading.scene_nodes import INSTANCING, instanced_nodes, mesh_nodes_of_other_scenes
from anim.gltf.validation.channel_targets import has_weight_pointers
from anim.model import Scene, Skeleton
from anim.sampling.weight_pointers import ineffective_weight_pointers
from anim.skinning.analysis.weight_sums import unnormalized_weights
from cli.errors import common_options
from cli.text import Reporter


def read_scene(
    document: Document,
    name: str,
    reporter: Reporter,
    *,
    accessors: Accessors | None = None,
    skeleton: Skeleton | None = None,
    normals: bool = False,
    tangents: bool = False,
    repeats: bool = True,
    nodes: Callable[[Scene], Collection[int] | None] = lambda _: None,
) -> Scene:
    """Return the scene of a document; warn of normalized skin weights, ignored mesh copies, constraints and pointers.

    name: of the file, for messages. accessors, skeleton: the document's, if the caller has them.
    normals, tangents, repeats: as for `reader.scene`. nodes: gives the nodes of the command's meshes; None for all.
    """
    found = reader.scene(document, accessors, skeleton, normals=normals, tangents=tangents, repeats=repeats)
    warn_of_scene(found, document, name, reporter, accessors=accessors, chosen=nodes(found))
    return found


def warn_of_nodes(error: AnimError, part: str, reporter: Reporter) -> None:
    """Warn that vertices can't be read, so that motion is measured at nodes and not on a part: "surface"."""
    hint = f" ({common_options(error.help)})" if error.help else ""
    reporter.warn(f"measured at nodes, not on the {part}: {error}{hint}")


def warn_of_scene(
    found: Scene,
    document: Document,
    name: str,
    reporter: Reporter,
    *,
    accessors: Accessors | None = None,
    chosen: Collection[int] | None = None,
) -> None:
    """Give the warnings of `read_scene` for the scene of a document. chosen: nodes of the command's meshes."""
    for bad in unnormalized_weights(each for each in found.instances if chosen is None or each.node in chosen):
        for words in bad.in_words():
            reporter.warn(f"{name}: {words}")
    _warn_of_copies(document, name, reporter, chosen)
    _warn_of_constraints(document, name, reporter)
    _warn_of_weight_pointers(document, found.skeleton, name, reporter, accessors)


def _warn_of_weight_pointers(
    document: Document, skeleton: Skeleton, name: str, reporter: Reporter, accessors: Accessors | None
) -> None:
    if not has_weight_pointers(document.json):
        return
    clips, _ = reader.readable_clips(document, accessors or Accessors(document))
    found = [pointer for clip in clips.values() for pointer in ineffective_weight_pointers(skeleton, clip)]
    for pointer in dict.fromkeys(found):
        reporter.warn(
            f"{name}: the pointer '{pointer}' moves nothing: no node has such morph weights, or others replace them"
        )


def _warn_of_copies(document: Document, name: str, reporter: Reporter, chosen: Collection[int] | None) -> None:
    copied = [i for i in instanced_nodes(document.json) if chosen is None or i in chosen]
    if copied:
        words = f" and {len(copied) - 1} more have" if len(copied) > 1 else " has"
        reporter.warn(
            f"{name}: {node_label(document.json, copied[0])}{words} copies of a mesh by {INSTANCING}: "
            "one copy per node counts here, and others may move farther than is said"
        )


def _warn_of_constraints(document: Document, name: str, reporter: Reporter) -> None:
    constrained = constrained_nodes(document.json)
    if constrained:
        words = f" and {len(constrained) - 1} more have" if len(constrained) > 1 else " has"
        reporter.warn(
            f"{name}: {node_label(document.json, constrained[0])}{words} a constraint by {CONSTRAINT}, which is not "
            "evaluated: players may show such nodes, and those below them, in other rotations"
        )


def warn_of_other_scenes(document: Document, name: str, reporter: Reporter, chosen: Collection[int] | None) -> None:
    """Warn of meshes that aren't in the default scene: players don't show them. chosen: nodes, None for all."""
    other = [i for i in mesh_nodes_of_other_scenes(document) if chosen is None or i in chosen]
    if other:
        label = node_label(document.json, other[0])
        subject = f"{label} and {len(other) - 1} more are" if len(other) > 1 else f"{label} is"
        meshes = "their meshes are" if len(other) > 1 else "its mesh is"
        reporter.warn(
            f"{name}: {subject} outside the default scene, which players show; {meshes} included (--mesh GLOB selects)"
        )
