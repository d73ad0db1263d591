"""Long simulations and bakes are counted before they are computed: exit 4, with the way out."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.anim.simulation.rigid_bodies.cases import needs_rapier
from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal

SPRINGS = ("springs", "ponytail", "--duration", "20000")
CLOTH = ("cloth", "flag", "--mesh", "flag", "--pin", "x-min", "--duration", "5000")
PARTICLES = ("particles", "biped", "--node", "head", "--drag", "1", "--lifetime", "1e5", "--duration", "2000")
RIGID = ("rigid", "wall", "--body", "brick*", "--shape", "box", "--floor", "0", "--duration", "5000")


@pytest.mark.parametrize(
    ("line", "who"),
    [
        (SPRINGS, "20000 s of 5 joints would take"),
        (CLOTH, "5000 s of"),
        (PARTICLES, "2000 s of 100000 particles would take"),
        pytest.param(RIGID, "5000 s of 30 moving bodies would take", marks=needs_rapier),
    ],
)
def test_frames_of_a_simulation_count(
    line: tuple[str, ...], who: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    kind, name, *options = line
    out = tmp_path / (
        "out.npz" if kind in ("cloth", "particles") else "out.glb"
    )  # morphs and nodes have their own limit
    run = call("simulate", kind, fixture(name), out, *options)
    assert who in refusal(run, 4)
    assert "(limit 1 GB)" in run.err
    assert "--duration" in help_line(run)
    assert "--memory-limit" in help_line(run)
    assert not out.exists()


def test_the_limit_of_a_simulation_can_be_chosen(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    line = ("simulate", "springs", fixture("ponytail"), tmp_path / "out.glb", "--duration", "2", "--memory-limit")
    assert "would take" in refusal(call(*line, "5MB", "--duration", "100"), 4)
    call(*line, "5MB").product()


def test_particles_on_parabolas_have_few_keys(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    line = ("--node", "head", "--rate", "1", "--lifetime", "1e5", "--duration", "100", "--memory-limit", "5MB")
    call("simulate", "particles", fixture("biped"), tmp_path / "out.glb", *line).product()
    assert "would take" in refusal(
        call("simulate", "particles", fixture("biped"), tmp_path / "out.glb", *line, "--drag", "1"), 4
    )


def test_frames_of_morph_targets_count(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    line = ("bake", fixture("arm"), tmp_path / "out.glb", "--clip", "bend", "--fps", "1000", "--memory-limit", "3MB")
    run = call(*line)
    assert "morph targets need all frames in memory" in refusal(run, 4)
    assert "--memory-limit" in help_line(run)


@pytest.mark.parametrize(
    "line",
    [
        ("bake", "arm", "--clip", "bend", "--fps", "20000"),
        ("simulate cloth", "flag", "--mesh", "flag", "--fps", "20000", "--step", "1/20000"),
    ],
)
def test_products_of_frames_count_before_any_is_computed(
    line: tuple[str, ...], fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Morph targets are shapes of the products of all pairs of frames."""
    monkeypatch.setattr("anim.caches.formats.gltf_morph.reduce_frames", None)
    monkeypatch.setattr("cli.commands.simulate.cloth.simulate_cloth", None)
    command, name, *options = line
    run = call(*command.split(), fixture(name), tmp_path / "out.glb", *options)
    assert "morph targets need all frames in memory: " in refusal(run, 4)
