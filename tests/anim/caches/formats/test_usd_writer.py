"""USD: usd-core itself reads what was written, and what it wrote is read."""

from __future__ import annotations

import signal
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.caches.formats import usd_writer
from anim.caches.formats.usd_stage import vectors
from anim.caches.storage import Memory
from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import FormatError
from tests.anim.caches.making import FACES, PARTS, cache, normals_of, opened, positions_of, written

pxr = pytest.importorskip("pxr", reason="usd-core is not installed")
ENDINGS = [".usdc", ".usda"]


@pytest.fixture(params=ENDINGS)
def stage(request: pytest.FixtureRequest, tmp_path: Path) -> Any:
    from pxr import Usd

    path = tmp_path / f"a{request.param}"
    path.write_bytes(written(cache(), path.name)[0].files[path.name])
    return Usd.Stage.Open(str(path))


def test_usd_core_reads_every_frame(stage: Any) -> None:
    from pxr import UsdGeom

    source = cache()
    whole = source.load_all()
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert stage.GetTimeCodesPerSecond() == 30
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, 6)
    mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
    assert mesh.GetPointsAttr().GetTimeSamples() == [0, 1, 2, 3, 4, 5, 6]
    assert np.array(mesh.GetPointsAttr().Get()) == pytest.approx(source.rest)
    assert np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3).tolist() == FACES.tolist()
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
    assert mesh.GetNormalsInterpolation() == "vertex"
    assert whole.normals is not None
    for f in range(7):
        assert (np.array(mesh.GetPointsAttr().Get(f)) == whole.positions[f]).all()
        assert (np.array(mesh.GetNormalsAttr().Get(f)) == whole.normals[f]).all()
        low, high = np.array(mesh.GetExtentAttr().Get(f))
        assert (low == whole.positions[f].min(axis=0)).all()
        assert (high == whole.positions[f].max(axis=0)).all()


@pytest.mark.parametrize("ending", ENDINGS)
def test_back_again(ending: str) -> None:
    source = cache()
    back = opened(written(source, f"a{ending}")[0])
    assert back.times == pytest.approx(source.times)
    assert (positions_of(back) == positions_of(source)).all()
    assert normals_of(back) == pytest.approx(normals_of(source), abs=1e-6)
    assert back.parts == PARTS
    assert opened(written(to_up_axis(source, "z"), f"a{ending}")[0]).up == "z"


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_same_cache_gives_the_same_bytes(ending: str) -> None:
    assert written(cache(), f"a{ending}")[0].files == written(cache(), f"a{ending}")[0].files


SCENE = """#usda 1.0
( metersPerUnit = 0.01
  upAxis = "Z"
  timeCodesPerSecond = 10 )
def Xform "group" {
  double3 xformOp:translate = (100, 0, 0)
  uniform token[] xformOpOrder = ["xformOp:translate"]
  def Mesh "quad" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points.timeSamples = {
      5: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
      10: [(0, 0, 7), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    }
  }
}
def Mesh "still" {
  int[] faceVertexCounts = [3]
  int[] faceVertexIndices = [2, 1, 0]
  point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
}
"""


def test_a_stage_of_others() -> None:
    back = opened(Memory("a.usda", {"a.usda": SCENE.encode()}))
    assert back.times.tolist() == [0.5, 1.0]
    assert back.faces.tolist() == [[0, 1, 2], [0, 2, 3], [6, 5, 4]]
    assert back.up == "z"
    positions = positions_of(back)
    assert positions[1, 0] == pytest.approx([1, 0, 0.07])
    assert positions[1, 6] == pytest.approx([0.01, 0.01, 0])


@pytest.mark.slow
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("cut", [0, 8, 60, 0.5])
def test_cut_off_files_are_refused_in_silence(ending: str, cut: float, capfd: pytest.CaptureFixture[str]) -> None:
    data = written(cache(), f"a{ending}")[0].files[f"a{ending}"]
    with pytest.raises(FormatError):
        opened(Memory(f"a{ending}", {f"a{ending}": data[: int(cut * len(data)) if cut < 1 else int(cut)]})).load_all()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "change", [("[0, 1, 2, 3]", "[0, 1, 2, 4]"), ("[4]", "[5]"), ("def Mesh", "def Scope"), ("7)", "nan)")]
)
def test_wrong_stages_are_refused(change: tuple[str, str]) -> None:
    with pytest.raises(FormatError):
        opened(Memory("a.usda", {"a.usda": SCENE.replace(*change).encode()})).load_all()


def test_a_signal_that_usd_core_discards_ends_the_writing(monkeypatch: pytest.MonkeyPatch) -> None:
    """It calls Python, as for modules on their first use, and an exception there is lost."""
    converted: list[None] = []

    def convert(rows: Any) -> Any:
        converted.append(None)
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return vectors(rows)

    monkeypatch.setattr(usd_writer, "vectors", convert)
    with pytest.raises(KeyboardInterrupt):
        written(cache(), "a.usdc")
    assert len(converted) == 2  # points and extent at rest
