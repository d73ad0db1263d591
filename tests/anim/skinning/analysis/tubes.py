"""A tube that one joint twists or bends."""

from __future__ import annotations

import numpy as np

from anim.gltf.reading import reader
from anim.model import Clip, Scene
from tests.clips import about, clip, track
from tests.files import opened_fixture


def tube() -> Scene:
    return reader.scene(opened_fixture("tube"))


def turned(axis: str, *angles: float) -> Clip:
    return clip(track("rotation", np.arange(len(angles)), about(axis, angles), node=1), name="turn")
