"""`resample` on real files: no new fault for the validator, nothing else changed, the same motion."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from tests import khronos
from tests.cli.conftest import Call, Find
from tests.cli.untouched import check_only_animations_changed
from tests.files import ASSETS, REAL, mark_slow, opened, opened_path

# Splines of rotations with few keys: a multiple of their rate comes near their motion, but is not the same.
COARSE = {"CubicRotate/01_cs_rotate.gltf": 5e-3}


@khronos.needs_validator
@pytest.mark.slow
def test_real_files_get_no_new_validator_errors(call: Call, tmp_path: Path) -> None:
    names = [name for name in REAL if (ASSETS / name).is_file()]
    if not names:
        pytest.skip("shared/assets is not there")
    outputs = []
    for name in names:
        call("resample", ASSETS / name, tmp_path / "out.glb", "--fps", "30").product()
        outputs.append((tmp_path / "out.glb").read_bytes())
    before = khronos.validate_many([(ASSETS / name).read_bytes() for name in names], resources=_beside())
    after = khronos.validate_many(outputs, resources=_beside())
    for name, old, new in zip(names, before, after, strict=True):
        if old["issues"]["truncated"]:
            assert set(_codes(new)) <= set(_codes(old)), name
        else:
            assert _codes(new) <= _codes(old), name


def _beside() -> dict[str, bytes]:
    """Everything that lies in the assets' folders, by the relative URI that the files use."""
    found = {}
    for path in ASSETS.rglob("*"):
        if path.suffix in (".bin", ".png", ".jpg"):
            parts = path.relative_to(ASSETS).parts
            found["/".join(parts[1:] if len(parts) > 1 else parts)] = path.read_bytes()
    return found


def _codes(report: dict[str, Any]) -> Counter[str]:
    # An embedded buffer has another pointer, so only kinds are compared; IO_ERRORs are about missing textures.
    return Counter(line.split(" ")[0] for line in khronos.errors(report))


@pytest.mark.parametrize("name", mark_slow(REAL))
def test_real_files_change_in_nothing_else(name: str, call: Call, asset: Find, tmp_path: Path) -> None:
    source, out = asset(name), tmp_path / "out.glb"
    call("resample", source, out, "--fps", "24").product()
    check_only_animations_changed(source, out)


@pytest.mark.parametrize("name", mark_slow(REAL))
def test_real_files_play_the_same_at_twice_their_rate(name: str, call: Call, asset: Find, tmp_path: Path) -> None:
    source, out = asset(name), tmp_path / "out.glb"
    clips = call("inspect", source, "--format", "json").json["files"][0]["clips"]
    regular = [clip for clip in clips if clip["frame_rate_regular"] == 1 and _ends_on_grid(clip)]
    if not regular:
        pytest.skip("no clip has a frame rate")
    rate = Counter(clip["frame_rate_fps"] for clip in regular).most_common(1)[0][0]
    chosen = [clip for clip in regular if clip["frame_rate_fps"] == rate]
    globs = [f"--clip={clip['name'] or clip['index']}" for clip in chosen]
    call("resample", source, out, "--fps", str(2 * rate), *globs).product()
    before, after = opened_path(source), opened(out.read_bytes())
    ruler = ErrorMetric(reader.scene(before))
    old, new = reader.clips(before), reader.clips(after)
    for clip in chosen:
        number = clip["index"]
        times = np.arange(0, clip["end_s"] + 1 / 240, 1 / 240)
        error = ruler.error_at(old[number], new[number], times)
        assert error.max_error <= COARSE.get(name, 1e-5) * ruler.diagonal, clip["name"]
        assert error.max_pointer_error <= 1e-5, (clip["name"], error.pointer)


def _ends_on_grid(clip: dict[str, Any]) -> bool:
    frames = clip["duration_s"] * clip["frame_rate_fps"]
    return bool(abs(frames - round(frames)) < 1e-3)


@pytest.mark.parametrize("name", mark_slow(["Knight.glb", "Robot.glb", "Fox.glb"]))
def test_real_files_never_grow_at_their_own_rate(name: str, call: Call, asset: Find, tmp_path: Path) -> None:
    call("resample", asset(name), tmp_path / "out.glb", "--fps", "24").product()
    assert (tmp_path / "out.glb").stat().st_size <= asset(name).stat().st_size * 1.01
