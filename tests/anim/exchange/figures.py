"""Recorded motions, and who they are put on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.evaluate import bounding_size, skeleton
from anim.exchange.euler.from_euler import ImportedMotion, from_euler
from anim.exchange.euler.motion import scale_motion
from anim.exchange.euler.unit_guess import guess_unit
from anim.exchange.formats import bvh_reader
from anim.exchange.retarget.apply import CharacterClip, apply_to_character
from anim.exchange.retarget.retarget import GroundMode
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.model import Skeleton
from tests.files import opened_fixture, opened_path

Find = Callable[[str], Path]


def recorded(name: str, asset: Find) -> ImportedMotion:
    """Return the motion of a recording in meters."""
    motion = bvh_reader.read(asset(f"bvh/{name}").read_bytes())
    return from_euler(
        scale_motion(motion, guess_unit(bounding_size(skeleton(motion))).scale), tolerance=1e-3, name="cmu"
    )


def character(name: str, asset: Find) -> Document:
    """Return the document of the biped, or of a real character."""
    return opened_fixture("biped") if name == "biped" else opened_path(asset(name))


def put_on(
    document: Document, source: ImportedMotion, aliases: dict[str, str], floor: GroundMode = GroundMode.CONTACT
) -> CharacterClip:
    """Return a motion as a clip of the character."""
    return apply_to_character(source, reader.scene(document), aliases=aliases, nested=True, floor=floor)


def tail(turn: Floats) -> Skeleton:
    """Return three joints in a row, no person's, at rest along x, the whole turned."""
    return Skeleton(
        ("tail1", "tail2", "tail3"), np.array([-1, 0, 1]), np.array([[0, 0, 0], [1.0, 0, 0], [1, 0, 0]]),
        np.array([turn, [0, 0, 0, 1], [0, 0, 0, 1]]), np.ones((3, 3)),
    )  # fmt: skip
