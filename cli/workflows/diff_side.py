"""The two inputs of `diff`, and what their names have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.scene_nodes import is_default_scene_empty
from anim.measure.compare.name_matching import ambiguous_names, match_by_letters
from anim.measure.inspect.storage_cost import StorageCost, storage_costs
from anim.measure.inspect.stored_bytes import stored_bytes
from anim.model import Clip, Scene
from anim.units import plural
from cli.io import documents, scenes
from cli.reports.diff_report import File
from cli.text import Reporter
from cli.workflows.mesh_pairs import is_bake_of, pages_of


class DiffSide(NamedTuple):
    """One of the two inputs, read."""

    file: File
    clips: tuple[Clip, ...]
    scene: Scene
    document: Document

    @property
    def is_flipbook(self) -> bool:
        """Return whether the frames are pages."""
        return pages_of(self.document) is not None


def open_side(path: str, reporter: Reporter) -> DiffSide:
    """Read one input, with warnings of what it shows."""
    with documents.source(path, reporter) as source:
        document = source.document
        accessors = Accessors(document)
        clips = reader.clips(document, accessors)
        scene = scenes.read_scene(document, source.name, reporter, accessors=accessors, repeats=False)
        if scene.instances and is_default_scene_empty(document):
            reporter.warn(f"{source.name}: the default scene has no mesh, most players show nothing")
        cost = StorageCost(stored_bytes(document), storage_costs(document)[1].json)
        return DiffSide(
            File(source.name, source.size, cost, tuple(clip.name for clip in clips)), clips, scene, document
        )


def common_names(one: DiffSide, other: DiffSide) -> tuple[int, tuple[bool, bool]]:
    """Return the number of nodes of one whose name exists in the other, and whether nodes of each have names."""
    nodes = one.scene.skeleton.names, other.scene.skeleton.names
    return int((match_by_letters(*nodes) >= 0).sum()), (any(nodes[0]), any(nodes[1]))


def ambiguous_clips(one: File, other: File, chosen: Sequence[int] | None) -> Iterator[str]:
    """Yield warnings of clip names with another count in the other file. chosen: clip indices of A."""
    looked_at = set(one.clips if chosen is None else (one.clips[i] for i in chosen))
    numbers = Counter(one.clips), Counter(other.clips)
    for name in ambiguous_names(one.clips, other.clips):
        if name in looked_at:
            counts = numbers[0][name], numbers[1][name]
            yield (
                f"{one.name} has {plural(counts[0], 'clip')} named '{name}' and {other.name} has {counts[1]}: "
                "they are matched in their order, which may be wrong"
            )


def are_bake_and_source(one: DiffSide, other: DiffSide) -> bool:
    """Return whether one of the inputs is a bake of the other."""
    is_book = one.is_flipbook or other.is_flipbook
    counts = len(one.clips), len(other.clips)
    return is_book or is_bake_of(one.scene, other.scene, counts[1]) or is_bake_of(other.scene, one.scene, counts[0])
