"""Slips in the arguments of `import anim` end in an AnimError with the actual and the expected value."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import anim
import fixtures
from anim import ops
from anim.arguments import glob_list
from anim.optimization.file_optimizer import FileOptimizer

Call = Callable[[anim.Asset], object]


@pytest.fixture(scope="module")
def biped() -> anim.Asset:
    return anim.load(fixtures.build("biped"))


WRONG: dict[str, tuple[Call, type[anim.AnimError], str]] = {
    "load null": (lambda asset: anim.load("a\0b"), anim.RangeError, "null character"),
    "load closed": (lambda asset: anim.load(_closed()), anim.ShapeError, "file is closed"),
    "save null": (lambda asset: asset.save("a\0.glb"), anim.RangeError, "null character"),
    "save None": (lambda asset: asset.save(_any(None)), anim.ShapeError, "path is None"),
    "save text": (lambda asset: asset.save(_any(io.StringIO())), anim.ShapeError, "open for text"),
    "save closed": (lambda asset: asset.save(_closed()), anim.ShapeError, "file is closed"),
    "map number": (lambda asset: asset.map_clips(_any(3)), anim.ShapeError, "change is int"),
    "map clips": (lambda asset: asset.map_clips(_same, clips=_any(1)), anim.ShapeError, "clips is int"),
    "map list": (
        lambda asset: asset.map_clips(_same, clips=_any([1])),
        anim.ShapeError,
        "clips has a value",
    ),
    "diff 0": (lambda asset: anim.diff(asset, asset, fps=0), anim.RangeError, "`fps` is 0"),
    "diff x": (lambda asset: anim.diff(asset, asset, fps=_any("x")), anim.ShapeError, "`fps` is 'x'"),
    "sample x": (lambda asset: anim.sample(asset, fps=_any("x")), anim.ShapeError, "`fps` is 'x'"),
    "sample times": (lambda asset: anim.sample(asset, times="a"), anim.ShapeError, "times"),
    "bake times": (lambda asset: anim.bake(asset, times="a"), anim.ShapeError, "times"),
    "resample x": (lambda asset: ops.resample(asset.clips[0], fps=_any("x")), anim.ShapeError, "`fps` is 'x'"),
    "bake None": (lambda asset: anim.bake(asset).save(_any(None)), anim.ShapeError, "path is None"),
    "bake file": (lambda asset: anim.bake(asset).save(_any(io.BytesIO())), anim.ShapeError, "path is BytesIO"),
    "error True": (lambda asset: anim.optimize(asset, max_error=True), anim.ShapeError, "`max_error` is True"),
    "error -1": (lambda asset: anim.optimize(asset, max_error=-1), anim.RangeError, "metres from 0, or a length"),
    "error 1": (lambda asset: anim.optimize(asset, max_error="1"), anim.RangeError, "without a unit"),
    "error 1e-3": (lambda asset: anim.optimize(asset, max_error=" 1e-3 "), anim.RangeError, "without a unit"),
    "speed 1.": (lambda asset: anim.optimize(asset, max_speed_error="1."), anim.RangeError, "without a unit"),
    "angle -1": (lambda asset: anim.optimize(asset, max_angle=-1), anim.RangeError, "max_angle is -1"),
    "angle list": (lambda asset: anim.optimize(asset, max_angle=_any([1])), anim.ShapeError, "`max_angle` is"),
    "workers -1": (lambda asset: anim.optimize(asset, workers=-1), anim.RangeError, "workers is -1"),
    "max_bytes 0": (lambda asset: anim.optimize(asset, max_bytes=0), anim.RangeError, "max_bytes is 0"),
    "max_bytes 9.5": (lambda asset: anim.optimize(asset, max_bytes=_any(9.5)), anim.ShapeError, "max_bytes is float"),
    "max_bytes 9kg": (lambda asset: anim.optimize(asset, max_bytes="9kg"), anim.RangeError, "max_bytes is '9kg'"),
    "workers 1.5": (lambda asset: anim.optimize(asset, workers=_any(1.5)), anim.ShapeError, "workers is float"),
    "progress": (lambda asset: anim.optimize(asset, progress=_any(1)), anim.ShapeError, "progress is int"),
    "clips True": (lambda asset: asset.clips[True], anim.ShapeError, "taken by bool"),
    "clips glob": (lambda asset: asset.clips["W*"], anim.NotFoundError, r"'W\*'"),
    "meshes": (lambda asset: anim.bake(asset, meshes="fox"), anim.NotFoundError, "'fox'"),
    "keep": (lambda asset: anim.optimize(asset, keep_nodes="zz*"), anim.NotFoundError, r"'zz\*'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_argument_raises_an_error_with_its_name(name: str, biped: anim.Asset) -> None:
    call, error, text = WRONG[name]
    with pytest.raises(error, match=text):
        call(biped)


@pytest.mark.parametrize("mode", ["rb", "w"])
def test_a_file_not_open_for_binary_writing_is_refused(mode: str, biped: anim.Asset, tmp_path: Path) -> None:
    path = tmp_path / "out.glb"
    path.touch()
    with path.open(mode) as file, pytest.raises(anim.ShapeError, match="open for") as caught:
        anim.save(biped, _any(file))
    assert caught.value.help == 'open it with "wb"'


def test_a_file_not_open_for_reading_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "in.glb").open("wb") as file, pytest.raises(anim.ShapeError, match="not open for reading"):
        anim.load(file)


def test_one_glob_is_not_split_into_letters(biped: anim.Asset) -> None:
    one = ops.select_tracks(biped.clips["walk"], biped.skeleton, nodes="hips", paths="rotation")
    assert one == ops.select_tracks(biped.clips["walk"], biped.skeleton, nodes=["hips"], paths=["rotation"])
    assert len(one) == 1
    assert (glob_list("b_*", "clips"), glob_list(None, "clips"), glob_list(("a", "b"), "clips")) == (
        ["b_*"],
        [],
        ["a", "b"],
    )


def test_zero_as_text_is_zero(biped: anim.Asset) -> None:
    exact = anim.optimize(biped, max_error=0, effort="fast")
    assert anim.optimize(biped, max_error="0", effort="fast").max_error == exact.max_error < 1e-12


def test_zero_workers_are_one_per_core(biped: anim.Asset, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[int] = []

    def record(optimizer: FileOptimizer, *_: object) -> None:
        given.append(optimizer.workers)
        raise anim.AnimError("enough")

    monkeypatch.setattr(FileOptimizer, "run", record)
    with pytest.raises(anim.AnimError, match="enough"):
        anim.optimize(biped, workers=0)
    assert given == [os.cpu_count()]


def _any(value: object) -> Any:
    return value


def _same(clip: anim.Clip) -> anim.Clip:
    return clip


def _closed() -> io.BytesIO:
    file = io.BytesIO()
    file.close()
    return file
