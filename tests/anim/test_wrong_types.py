"""Arguments of a wrong type at public functions: one line with the parameter, not an error from inside."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import anim
from anim import ops
from anim.errors import RangeError, ShapeError
from anim.gltf.writing import writer
from anim.sampling.sample import sample
from anim.skinning.bake import bake
from fixtures.table import build

ASSET = anim.load(build("biped"))
CLIP: Any = ASSET.clips["walk"]
WRONG: Any = ASSET
TEXT: Any = "10"
NONE: Any = None
NUMBER: Any = 0
NAMES: Any = {"hips"}
CLIPS: Any = [CLIP]
DOCUMENT: Any = ASSET.document
SHAPES: dict[str, tuple[Callable[[], object], str]] = {
    "asset for clip": (lambda: ops.resample(WRONG, fps=10), "clip is Asset"),
    "ease an asset": (lambda: ops.ease(WRONG, easing="quad-in"), "clip is Asset"),
    "text for fps": (lambda: ops.resample(CLIP, fps=TEXT), "`fps` is '10'"),
    "no fps": (lambda: ops.resample(CLIP, fps=NONE), "`fps` is None"),
    "index for tracks": (lambda: ops.trim(CLIP, tracks=NUMBER), "tracks is 0"),
    "names for tracks": (lambda: ops.spline(CLIP, tracks=NAMES), "tracks is {'hips'}"),
    "text for speed": (lambda: ops.retime(CLIP, speed=TEXT), "`speed` is '10'"),
    "no easing": (lambda: ops.warp(CLIP, easing=NONE), "easing is None"),
    "swapped": (lambda: sample(CLIP, WRONG, np.zeros(1)), "skeleton is Clip"),
    "document for scene": (lambda: bake(DOCUMENT, CLIP, times=np.zeros(1)), "scene is Document"),
    "names for nodes": (
        lambda: bake(ASSET.scene, CLIP, times=np.zeros(1), nodes=TEXT),
        "nodes is '10'",
    ),
    "facade fps": (lambda: anim.sample(ASSET, fps=TEXT), "`fps` is '10'"),
    "facade times": (lambda: anim.sample(ASSET, times="x"), "times holds something that is no number"),
    "player": (lambda: anim.diff(ASSET, ASSET, player=NONE), "player is None"),
    "list of clips": (lambda: writer.replace_clips(ASSET.document, CLIPS), "clips is list"),
    "path": (lambda: anim.save(ASSET, NONE), "path is None"),
}
RANGES: dict[str, tuple[Callable[[], object], str]] = {
    "track": (lambda: ops.resample(CLIP, fps=10, tracks=frozenset({999})), "there is no track 999"),
    "threads": (lambda: bake(ASSET.scene, CLIP, times=np.zeros(1), threads=-1), "`threads` is -1"),
    "diff fps": (lambda: anim.diff(ASSET, ASSET, fps=0), "`fps` is 0"),
}


@pytest.mark.parametrize("case", SHAPES)
def test_wrong_types_are_refused_by_name(case: str) -> None:
    call, words = SHAPES[case]
    with pytest.raises(ShapeError) as refused:
        call()
    assert words in str(refused.value)


@pytest.mark.parametrize("case", RANGES)
def test_values_out_of_range_are_refused_by_name(case: str) -> None:
    call, words = RANGES[case]
    with pytest.raises(RangeError) as refused:
        call()
    assert words in str(refused.value)
