"""Scales of joints in USD: those that float16 holds, and refusals before anything is written."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from anim.caches.storage import Memory
from anim.errors import DataRangeError, UnsupportedError
from anim.exchange.usd_skel.stage_points import StagePoints
from anim.exchange.usd_skel.write import UsdSkelResult, write
from anim.gltf.reading import reader
from anim.model import Clip, Track
from tests.files import opened_fixture

pytest.importorskip("pxr", reason="usd-core is not installed")


def _scaled(last: float) -> tuple[Memory, str, Callable[[], UsdSkelResult]]:
    """Writes the arm with scales of its last joint from 1 to `last`."""
    document = opened_fixture("arm")
    scene, clip = reader.scene(document), reader.clips(document)[1]
    (instance,) = scene.instances
    assert instance.skin is not None
    node = int(instance.skin.joints[-1])
    kept = [track for track in clip.tracks if (track.node, track.path) != (node, "scale")]
    moved = Track(node, "scale", "LINEAR", [0, 1], np.array([[1, 1, 1], [1, last, 1]]))
    outputs = Memory("out.usda")
    played = Clip("scaled", (*kept, moved))
    return (
        outputs,
        scene.skeleton.display_name(node),
        lambda: write(document, scene, played, outputs, ending=".usda", fps=5),
    )


@pytest.mark.parametrize("last", [1e5, 1e18, 1e30])
def test_scales_beyond_float16_are_refused(last: float) -> None:
    """They were written as `inf`, with an error of 0 mm: a NaN is less than any error."""
    outputs, name, write_scaled = _scaled(last)
    with pytest.raises(UnsupportedError, match=f"joint '{name}' has a scale of .* s, and USD stores .* up to 65504"):
        write_scaled()
    assert not outputs.files


def test_scales_within_float16_are_written() -> None:
    outputs, _, write_scaled = _scaled(65504.0)
    write_scaled()
    assert b"(inf" not in outputs.files["out.usda"]


def test_vertices_of_a_stage_that_are_not_finite_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StagePoints, "at", lambda *_: np.full((1, 3), np.nan))
    outputs, _, write_scaled = _scaled(2.0)
    with pytest.raises(DataRangeError, match="vertices are not finite at 0 s as USD skins them"):
        write_scaled()
    assert not outputs.files
