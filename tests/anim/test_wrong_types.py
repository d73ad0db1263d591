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
from anim.operations.ease import Tolerances
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
HUGE = 10**400
half: Callable[[float], Any] = np.float16
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
    "ragged times": (lambda: anim.sample(ASSET, times=[[0], [1, 2]]), "times holds something that is no number"),
    "ragged times of a bake": (
        lambda: anim.bake(ASSET, times=[[0], [1, 2]]),
        "times holds something that is no number",
    ),
    "dates": (lambda: anim.sample(ASSET, times=np.array(["2020"], "M8[s]")), "is no number (dates)"),
    "no date": (lambda: anim.sample(ASSET, times=np.array(["NaT"], "M8[s]")), "is no number (dates)"),
    "masked times": (
        lambda: anim.sample(ASSET, times=np.ma.array([0, 1], mask=[False, True])),
        "times has masked values",
    ),
    "tangents": (lambda: ops.spline(CLIP, tangents=NUMBER), "tangents is int"),
    "no tangents": (lambda: ops.spline(CLIP, tangents=NONE), "tangents is None"),
    "cyclic": (lambda: ops.spline(CLIP, cyclic=TEXT), "`cyclic` is '10'"),
    "root": (lambda: ops.spline(CLIP, root=TEXT), "`root` is '10'"),
    "root of a frame": (lambda: ops.append_first_frame(CLIP, fps=10, root=TEXT), "`root` is '10'"),
    "label": (lambda: ops.spline(CLIP, label=NUMBER), "label is int"),
    "offset": (lambda: ops.retime(CLIP, offset=TEXT), "`offset` is '10'"),
    "no offset": (lambda: ops.retime(CLIP, offset=NONE), "`offset` is None"),
    "array for speed": (lambda: ops.retime(CLIP, speed=np.zeros((50, 50))), "`speed` is ndarray"),  # type: ignore[arg-type]
    "reverse": (lambda: ops.retime(CLIP, reverse=TEXT), "`reverse` is '10'"),
    "ping-pong": (lambda: ops.retime(CLIP, ping_pong=NUMBER), "`ping_pong` is 0"),
    "rebase": (lambda: ops.trim(CLIP, rebase=TEXT), "`rebase` is '10'"),
    "snap": (lambda: ops.resample(CLIP, fps=10, snap=TEXT), "`snap` is '10'"),
    "start of ease": (lambda: ops.ease(CLIP, easing="linear", start=TEXT), "`start` is '10'"),
    "start of warp": (lambda: ops.warp(CLIP, easing="linear", start=TEXT), "`start` is '10'"),
    "tolerance": (lambda: ops.warp(CLIP, easing="linear", tolerance=TEXT), "`tolerance` is '10'"),
    "tolerances": (lambda: ops.ease(CLIP, easing="linear", tolerances=NUMBER), "tolerances is int"),
    "rebase_rest": (lambda: anim.optimize(ASSET, rebase_rest=TEXT), "`rebase_rest` is '10'"),
    "normals": (lambda: anim.bake(ASSET, normals=NUMBER), "`normals` is 0"),
    "page time": (lambda: anim.page(ASSET, time=TEXT), "`time` is '10'"),
    "page show": (lambda: anim.page(ASSET, show=NUMBER), "show is int"),
}
RANGES: dict[str, tuple[Callable[[], object], str]] = {
    "track": (lambda: ops.resample(CLIP, fps=10, tracks=frozenset({999})), "there is no track 999"),
    "threads": (lambda: bake(ASSET.scene, CLIP, times=np.zeros(1), threads=-1), "`threads` is -1"),
    "huge fps": (lambda: anim.sample(ASSET, fps=HUGE), "`fps` is beyond all floats"),
    "huge error": (lambda: anim.optimize(ASSET, max_error=HUGE), "`max_error` is beyond all floats"),
    "huge offset": (lambda: ops.retime(CLIP, offset=HUGE), "`offset` is beyond all floats"),
    "huge time": (lambda: anim.TimeAxis([0, HUGE]), "times holds a number beyond all floats"),
    "huge value": (
        lambda: anim.Track(0, "translation", "LINEAR", [0], [[HUGE, 0, 0]]),
        "values holds a number beyond all floats",
    ),
    "range of ease": (lambda: ops.ease(CLIP, easing="linear", start=1, end=0), "the range from 1 s to 0 s is empty"),
    "range of warp": (lambda: ops.warp(CLIP, easing="quad-in", start=-1e308, end=1e308), "is too long"),
    "interpolation": (lambda: ops.warp(CLIP, easing="linear", interpolation="x"), "`interpolation` is 'x'"),
    "tolerance": (lambda: ops.warp(CLIP, easing="linear", tolerance=-1), "`tolerance` is -1"),
    "tolerances": (lambda: ops.ease(CLIP, easing="linear", tolerances=Tolerances(angle=0)), "`angle_tolerance` is 0"),
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


def test_numbers_of_low_precision_compute_in_float64() -> None:
    """A float16 has no number above 65 504, and a third of it is off by 1e-4."""
    assert ops.retime(CLIP, speed=half(3)).end == ops.retime(CLIP, speed=3).end
    assert ops.resample(CLIP, fps=half(24)) == ops.resample(CLIP, fps=24)
    assert ops.append_first_frame(CLIP, fps=half(24)) == ops.append_first_frame(CLIP, fps=24)
    assert ops.loop(CLIP, blend=half(0.25), frame_rate=half(24)) == ops.loop(CLIP, blend=0.25, frame_rate=24)
    np.testing.assert_array_equal(anim.sample(ASSET, fps=half(24)), anim.sample(ASSET, fps=24))


def test_times_beyond_float32_are_outside_the_clip() -> None:
    assert ops.trim(CLIP, start=-1e300, end=1e300) == ops.trim(CLIP, start=-1, end=9)


def test_flags_of_numpy_are_flags() -> None:
    assert ops.retime(CLIP, reverse=np.bool_(True)) == ops.retime(CLIP, reverse=True)  # type: ignore[arg-type]


def test_a_limit_of_bytes_beyond_all_floats_is_no_limit() -> None:
    assert anim.optimize(ASSET, max_bytes=HUGE, effort="fast").max_error < 1


@pytest.mark.parametrize("value", [3.5e38, 1e200, -1e308])
def test_values_beyond_float32_are_not_written(value: float) -> None:
    track = anim.Track(0, "translation", "LINEAR", [0], [[value, 0, 0]])
    with pytest.raises(RangeError, match="too large for float32"):
        ASSET.add_clips([anim.Clip("far", (track,))])
    most = anim.Track(0, "translation", "LINEAR", [0], [[3.4028235e38, 0, 0]])
    assert ASSET.add_clips([anim.Clip("far", (most,))]).clips["far"].tracks[0].values[0, 0] == np.finfo("f4").max
