"""What the tests of packed clips share: documents to pack, clips to pack, and whether they come back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

import fixtures
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip, TimeAxis, Track
from fixtures.broken.pieces import animated, glb, text
from tests.anim.gltf.meshopt.packing import exponents, quaternions
from tests.anim.gltf.writing.documents import check_same
from tests.clips import track
from tests.files import opened, opened_fixture, opened_path

Find = Callable[[str], Path]

RNG = np.random.default_rng(5)
KEYS = 60
TIMES = np.arange(KEYS, dtype=np.float32) / 30
SMOOTH = np.cumsum(RNG.normal(size=(KEYS, 4)), axis=0) / 50 + (0, 0, 0, 2)
PATHS = ("Fox.glb", "CesiumMan.glb", "BitmojiRun.glb", "MorphStressTest.glb", "CubicMorph/01_cs_morph.gltf")


def opened_any(name: str, asset: Find) -> Document:
    """Return the document of a fixture, or of a real file."""
    return opened_fixture(name) if name in fixtures.FIXTURES else opened_path(asset(name))


def of_nodes(count: int) -> Document:
    """Return a document of one clip and so many nodes without parents."""
    return opened(glb(text(animated() | {"nodes": [{}] * count, "scenes": [{"nodes": list(range(count))}]})))


def check_clips(clips: dict[int, Clip], document: Document) -> None:
    """Assert that clips are in the document bit by bit, by number.

    Targets may be in another order, and there may be two tracks of one pointer.
    """
    found = reader.clips(document)
    for number, clip in clips.items():
        assert len(clip.tracks) == len(found[number].tracks)
        for mine, theirs in zip(*(sorted(each.tracks, key=_target) for each in (clip, found[number])), strict=True):
            check_same(mine, theirs)


def _target(each: Track) -> str:
    return str(each.target)


def as_float32(clip: Clip) -> Clip:
    """Return the clip with times as a file holds them."""
    return Clip(
        clip.name, tuple(replace(each, time_axis=TimeAxis(each.times.astype(np.float32))) for each in clip.tracks)
    )


def packed_walk(extension: str, *, keys: int = KEYS) -> tuple[Clip, Document]:
    """Return a clip of one rotation and one translation, and a file of one node that it is packed into."""
    turn = quaternions(track("rotation", TIMES[:keys], SMOOTH[:keys]))
    move = exponents(track("translation", TIMES[:keys], SMOOTH[:keys, :3]))
    clip = Clip("walk", (turn, move))
    return clip, writer.replace_clips(of_nodes(1), {0: clip}, extension=extension)
