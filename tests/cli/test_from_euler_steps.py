"""`from-euler --onto`: steps stay steps, and nothing is keyed that does not move; three.js judges."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip, Interpolation, Track
from tests.cli.conftest import Call
from tests.clips import LINEAR, STEP, about, clip, track
from tests.files import glb_of, opened_fixture, opened_path
from tests.judge import judge, needs_judge


def _put_back(clip: Clip, call: Call, tmp_path: Path) -> tuple[Path, Path]:
    """The arm with this clip, and the same through curves and back."""
    truth, curves, back = tmp_path / "truth.glb", tmp_path / "curves.json", tmp_path / "back.glb"
    truth.write_bytes(glb_of(writer.replace_clips(opened_fixture("arm"), {0: clip})))
    assert call("to-euler", truth, curves, "--clip", "#0", "--order", "XYZ").code == 0
    assert call("from-euler", curves, back, "--onto", truth, "--replace", "#0").code == 0
    return truth, back


def _tracks(file: Path) -> dict[tuple[int | None, str], Track]:
    return {(each.node, each.path): each for each in reader.clips(opened_path(file))[0].tracks}


@needs_judge
def test_steps_stay_steps(call: Call, tmp_path: Path) -> None:
    """The lower joint moves on, the upper one jumps: each keeps its kind, no key pairs, no track more."""
    waving = track("rotation", np.linspace(0, 1, 11), about("x", 40 * np.sin(np.arange(11.0))), LINEAR, node=0)
    turns = track("rotation", (0, 0.3, 1), about("z", (0.0, 60, -100)), STEP, node=1)
    sizes = track("scale", (0, 0.25, 0.6, 1), [(1, 1, 1), (2, 2, 2), (0.5, 1, 1), (1, 1, 1)], STEP, node=1)
    truth, back = _put_back(clip(waving, turns, sizes, name="jumps"), call, tmp_path)
    found = _tracks(back)
    assert {key: each.interpolation for key, each in found.items()} == {
        (0, "rotation"): LINEAR,
        (1, "rotation"): STEP,
        (1, "scale"): STEP,
    }
    assert found[1, "scale"].times.tolist() == reader.clips(opened_path(truth))[0].tracks[2].times.tolist()
    assert min(np.diff(each.times).min() for each in found.values()) > 0.01
    assert judge(truth, back).max_error < 1e-6


def test_stretches_without_change_have_no_keys_inside(call: Call, tmp_path: Path) -> None:
    times = np.array((0.0, 0.37, 0.5, 0.63, 1))
    held = track("rotation", times, about("x", (0.0, 20, 20, 20, 50)), LINEAR, node=0)
    other = track("rotation", times, about("z", (0.0, 5, -10, 15, 0)), LINEAR, node=1)
    _, back = _put_back(clip(held, other, name="waits"), call, tmp_path)
    found = _tracks(back)
    assert {each.interpolation for each in found.values()} == {Interpolation.LINEAR}
    np.testing.assert_allclose(found[0, "rotation"].times, (0, 0.37, 0.63, 1), rtol=1e-6)
    assert found.keys() == {(0, "rotation"), (1, "rotation")}
