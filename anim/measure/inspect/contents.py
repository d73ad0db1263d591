"""Readable parts of a file: clips, skeleton and meshes, each read once."""

from __future__ import annotations

from typing import NamedTuple

from anim.errors import AnimError
from anim.gltf.document import Document, json_array
from anim.gltf.io.lenient import BrokenFile
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Scene, Skeleton


class FileContents(NamedTuple):
    """Parts of a file that can be read. file_bytes: size of the file, for fractions of it.

    clips: by index. scene: None if vertices can't be read, for scene_error. faults: reasons for which other commands
    refuse the file. lost_skins: indices of skins that can't be read. motion: of the scene's vertices, or of the nodes.
    """

    document: Document
    file_bytes: int
    accessors: Accessors
    clips: dict[int, Clip]
    skeleton: Skeleton
    scene: Scene | None
    scene_error: AnimError | None
    faults: tuple[AnimError, ...]
    lost_skins: frozenset[int]
    motion: SkinMotion

    @property
    def unreadable_clips(self) -> int:
        """Number of animations that can't be read."""
        return len(json_array(self.document.json, "animations")) - len(self.clips)


def read_contents(document: Document, *, file_bytes: int, broken: BrokenFile | None = None) -> FileContents:
    """Return the readable parts. broken: the faults of a file of which the document is only a part."""
    accessors = Accessors(document)
    clips, unread = reader.readable_clips(document, accessors)
    skeleton = reader.skeleton(document)
    scene, scene_error = _scene(document, accessors, skeleton)
    lost = broken.lost_clips if broken else frozenset()
    return FileContents(
        document,
        file_bytes,
        accessors,
        {i: clip for i, clip in clips.items() if i not in lost},
        skeleton,
        scene,
        scene_error,
        (*broken.faults, *unread) if broken else tuple(unread),
        broken.lost_skins if broken else frozenset(),
        SkinMotion(scene or Scene(skeleton, ())),
    )


def _scene(document: Document, accessors: Accessors, skeleton: Skeleton) -> tuple[Scene | None, AnimError | None]:
    try:
        return reader.scene(document, accessors, skeleton, repeats=False), None
    except AnimError as error:
        return None, error
