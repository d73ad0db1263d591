"""Alembic: alembic3d itself reads what was written. Blender does too: tests/cli/test_in_blender.py."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from anim.caches.options import WriteOptions
from anim.caches.source_document.bake_source import BakeSource
from anim.caches.storage import Memory
from anim.errors import OutputError, UnsupportedError
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.model import FrameChunk, VertexCache
from anim.skinning.bake import prepare_bake
from tests.anim.caches.making import cache, normals_of, opened, positions_of, written
from tests.files import opened as document_of
from tests.textured import textured

pytest.importorskip("alembic3d", reason="alembic3d is not installed")


class Archive:
    """The one mesh of a file, read by alembic3d."""

    def __init__(self, files: Memory, folder: Path) -> None:
        from alembic3d import Abc, AbcGeom

        (folder / "a.abc").write_bytes(files.files["a.abc"])
        self._selector = Abc.ISampleSelector
        self._file = Abc.IArchive(str(folder / "a.abc"))
        self.schema = AbcGeom.IPolyMesh(self._file.getTop(), "mesh").getSchema()
        sampling = self.schema.getTimeSampling()
        self.times = [sampling.getSampleTime(i) for i in range(self.schema.getNumSamples())]

    def positions(self) -> Any:
        samples = [self.schema.getValue(self._selector(time)) for time in self.times]
        return np.array([np.array(memoryview(each.getPositions())) for each in samples])

    def expanded(self, parameter: Any) -> Any:
        samples = [parameter.getExpandedValue(self._selector(time)) for time in self.times]
        return np.array([np.array(memoryview(each.getVals())) for each in samples])

    def faces(self) -> Any:
        sample = self.schema.getValue(self._selector(0.0))
        assert set(memoryview(sample.getFaceCounts())) == {3}
        return np.array(memoryview(sample.getFaceIndices())).reshape(-1, 3)


@pytest.mark.parametrize("normals", [True, False])
@pytest.mark.parametrize("times", [np.arange(7) / 30, np.array([0.1, 0.2, 0.25, 0.5, 0.51, 1.0, 4.0])])
def test_every_frame_is_there(normals: bool, times: Any, tmp_path: Path) -> None:
    source = replace(cache(normals=normals), times=times)
    found = Archive(written(source, "a.abc")[0], tmp_path)
    assert found.times == pytest.approx(times, abs=1e-9)
    assert (found.positions() == positions_of(source)).all()
    assert found.faces().tolist() == source.faces[:, ::-1].tolist()
    assert found.schema.getNormalsParam().valid() is normals
    if normals:
        assert (found.expanded(found.schema.getNormalsParam()) == normals_of(source)).all()


def test_texture_coordinates(tmp_path: Path) -> None:
    """Without a transform, those of the source with v from the bottom."""
    document = document_of(textured())
    baker = prepare_bake(reader.scene(document))
    source = baker.bake(reader.clips(document)[0], times=np.array([0.0, 1.0]))
    files = written(source, "a.abc", WriteOptions(source=BakeSource(document, 0)))[0]
    found = Archive(files, tmp_path)
    (first, last) = found.expanded(found.schema.getUVsParam())
    rows = Accessors(document).floats(document.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"])
    assert first[: len(rows)] == pytest.approx(np.stack((rows[:, 0], 1 - rows[:, 1]), axis=1), abs=1e-6)
    assert (first == last).all()


def test_the_same_cache_gives_the_same_bytes() -> None:
    assert written(cache(), "a.abc")[0].files == written(cache(), "a.abc")[0].files


def test_rows_in_any_memory_order(tmp_path: Path) -> None:
    positions = np.asfortranarray(np.random.default_rng(2).normal(size=(2, 3, 3)).astype(np.float32))
    source = VertexCache(np.arange(2.0), 3, np.array([[0, 1, 2]]), lambda: iter((FrameChunk(0, positions),)))
    assert (Archive(written(source, "a.abc")[0], tmp_path).positions() == positions).all()


def test_it_is_not_read() -> None:
    with pytest.raises(UnsupportedError, match="abc is only written, not read"):
        opened(written(cache(), "a.abc")[0])


def test_a_full_folder_for_temporary_files_is_refused_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """alembic3d aborts the process where a write fails."""
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=10))
    with pytest.raises(OutputError, match="don't fit"):
        written(cache(), "a.abc")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no `ulimit -f`")
def test_a_limit_of_files_is_heeded_before(monkeypatch: pytest.MonkeyPatch) -> None:
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda kind: (10, resource.RLIM_INFINITY))
    with pytest.raises(OutputError, match=r"\(10 free\)"):
        written(cache(), "a.abc")
