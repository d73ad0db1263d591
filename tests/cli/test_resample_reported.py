"""What `resample` says at the end: the error is that of the skin, by another route, and a dry run says the same."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from tests.anim.measure.error.brute_force import Find
from tests.cli.conftest import Call, Fixture
from tests.cli.playing import Floats, Player
from tests.fixtures.reading import decode
from tests.judge import judge, needs_judge


def test_the_reported_error_is_that_of_the_skin(biped: bytes, call: Call) -> None:
    run = call("resample", "-", "-", "--fps", "7", "--clip", "walk", stdin=biped)
    found = re.search(r"\(([\d.]+) %\) at '\w+', ([\d.]+) s", run.err)
    assert found, run.err
    old, new = Player(biped), Player(run.product())
    axes = {time for player in (old, new) for channel in player.channels(0) for time in channel.times}
    times = sorted(axes | {(a + b) / 2 for a, b in itertools.pairwise(sorted(axes))})
    skin = Skin(old)
    far = [np.linalg.norm(skin.at(old, time) - skin.at(new, time), axis=1).max() for time in times]
    assert reported(run.err) == pytest.approx(max(far), rel=0.05)  # two digits are reported
    assert float(found[2]) == pytest.approx(times[int(np.argmax(far))], abs=1e-3)
    rest = skin.positions
    diagonal = np.linalg.norm(rest.max(axis=0) - rest.min(axis=0))
    assert float(found[1]) == pytest.approx(100 * max(far) / diagonal, rel=0.05)


@needs_judge
@pytest.mark.parametrize("command", [["spline"], ["resample", "--fps", "24", "--interpolation", "cubicspline"]])
@pytest.mark.parametrize("name", ["Fox.glb", pytest.param("Robot.glb", marks=pytest.mark.slow)])
def test_three_finds_the_same_maximum(asset: Find, call: Call, tmp_path: Path, name: str, command: list[str]) -> None:
    made = tmp_path / name
    run = call(command[0], asset(name), made, *command[1:])
    truth = judge(asset(name), made, rate=960)
    assert reported(run.err) == pytest.approx(truth.max_error, rel=0.05)  # two digits are reported


def reported(line: str) -> float:
    """The largest error in metres that a line speaks of."""
    found = re.search(r"max ([\d.]+) (nm|µm|mm|cm|m)\b", line)
    assert found, line
    return float(found[1]) * {"nm": 1e-9, "µm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0}[found[2]]


class Skin:
    """The only skin of a file, blended vertex by vertex as the specification says."""

    def __init__(self, player: Player) -> None:
        document = player.document
        attributes = [primitive["attributes"] for primitive in document["meshes"][0]["primitives"]]
        self.positions, self.joints, self.weights = (
            np.concatenate([decode(document, player.blob, each[key]) for each in attributes])
            for key in ("POSITION", "JOINTS_0", "WEIGHTS_0")
        )
        self.nodes = document["skins"][0]["joints"]
        self.bind = np.array(decode(document, player.blob, document["skins"][0]["inverseBindMatrices"]))

    def at(self, player: Player, time: float) -> Floats:
        """Vertices (V, 3) of the first clip at a time in seconds."""
        matrices = player.world(0, time)[self.nodes] @ self.bind
        blended = np.einsum("vi,vijk->vjk", self.weights, matrices[self.joints.astype(int)])
        points: Floats = (blended @ np.c_[self.positions, np.ones(len(self.positions))][..., None])[:, :3, 0]
        return points


def test_the_last_line_says_what_came_of_it(biped: bytes, call: Call, tmp_path: Path) -> None:
    source, out = tmp_path / "in.glb", tmp_path / "out.glb"
    source.write_bytes(biped)
    run = call("resample", source, out, "--fps", "12", "-v")
    size = len(out.read_bytes())
    assert (run.code, run.out) == (0, b"")
    *clips, line = run.err.splitlines()
    assert [clip.split("'")[1] for clip in clips] == ["walk", "wave", "jump"]
    percent = round(100 * (size / len(biped) - 1))
    assert line.startswith(f"{out}  271 kB → {size / 1000:.0f} kB ({percent:+} %), 1030 → ")
    counted = sum(len(c.times) for n in range(3) for c in Player(out.read_bytes()).channels(n))
    assert f"→ {counted} keys, max " in line
    assert reported(line) == max(map(reported, clips)) > min(map(reported, clips))
    assert line.endswith(" s")
    assert call("resample", source, out, "--fps", "12", "--quiet").err == ""


def test_a_dry_run_says_the_same_and_writes_nothing(biped: bytes, call: Call, tmp_path: Path) -> None:
    real = call("resample", "-", "-", "--fps", "12", stdin=biped)
    for out in ("-", tmp_path / "out.glb", tmp_path / "out.gltf"):
        dry = call("resample", "-", out, "--fps", "12", "--dry-run", stdin=biped)
        assert (dry.code, dry.out) == (0, b"")
        assert dry.err.endswith(" (dry run: nothing written)\n")
        if out == "-":
            assert dry.err.split(", ")[1:3] == real.err.split(", ")[1:3]
    assert list(tmp_path.iterdir()) == []


def test_non_unit_keys_make_the_stated_error_one_of_players_that_normalize(fixture: Fixture, call: Call) -> None:
    """Also with -q, for it changes what the number means; not where no such track is changed."""
    path = fixture("noop")
    run = call("resample", path, "-", "--fps", "30", "-q")
    assert "warning: 1 rotation key of clip 'non_unit' is not a unit quaternion" in run.err
    assert "normalize" in run.err
    assert "unit quaternion" not in call("resample", path, "-", "--fps", "30", "--clip", "straight").err
    assert "unit quaternion" not in call("resample", path, "-", "--fps", "30", "--path", "translation").err
