"""`optimize`: smaller animations within a bound, and what it leaves alone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from anim.gltf.reading import reader
from anim.optimization import file_optimizer
from anim.optimization.writing import KEY
from tests.cli.comparing import apart
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.untouched import around
from tests.files import opened_path

FAST = ("--effort", "fast")


# The bound


@pytest.mark.parametrize("options", [("--drop", "rest"), ("--meshopt", "khr")])
def test_the_file_is_smaller_and_keeps_the_bound(
    options: tuple[str, ...], fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    source, output = fixture("biped"), tmp_path / "out.glb"
    run = call("optimize", source, output, "--max-error", "2mm", *FAST, *options)
    assert (run.code, run.out) == (0, b"")
    assert output.stat().st_size < source.stat().st_size
    for player in ("spec", "three", "raw", "nlerp"):
        assert apart(call, source, output, "--player", player)["max_error_m"] <= 0.002
    first = run.err.splitlines()[0]
    assert first.startswith(f"{output}  ")
    assert " keys, max " in first
    assert "animation " in first


@pytest.mark.parametrize("name", ["interpolations", "morph_cube", "pointer", "noop", "accessors"])
def test_0_is_without_loss(name: str, fixture: Fixture, tmp_path: Path, call: Call) -> None:
    for zero in ("0", "0%", "0.0mm"):
        run = call("optimize", fixture(name), tmp_path / "out.glb", "--max-error", zero, "--max-pointer-error", "0")
        assert run.code == 0, run.err
    found = apart(call, fixture(name), tmp_path / "out.glb")
    assert found["max_error_m"] <= 1e-9 * found["diagonal_m"]
    assert all(each["max_pointer_error"] <= 1e-9 for each in found["clips"])


def test_the_default_is_a_hundredth_of_a_percent(fixture: Fixture, call: Call) -> None:
    report = json.loads(call("optimize", fixture("noop"), "-n", "--report", "-").product())
    assert report["bounds"]["max_error_m"] == pytest.approx(1e-4 * report["diagonal_m"])
    assert report["bounds"]["shell_m"] == pytest.approx(1e-2 * report["diagonal_m"])
    assert report["policy"]["effort"] == "balanced"


@pytest.mark.parametrize("name", ["SimpleSkin.gltf", "RiggedSimple.gltf"])
def test_small_real_files(name: str, asset: Find, tmp_path: Path, call: Call) -> None:
    output = tmp_path / "out.glb"
    assert call("optimize", asset(name), output, "--max-error", "0.1%", *FAST).code == 0
    assert apart(call, asset(name), output, "--player", "three")["max_error_percent"] <= 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fox.glb", "MorphStressTest.glb", "Robot.glb", "Knight.glb"])
def test_larger_real_files(name: str, asset: Find, tmp_path: Path, call: Call) -> None:
    output = tmp_path / "out.glb"
    assert call("optimize", asset(name), output, "--max-error", "0.1%", *FAST).code == 0
    for player in ("three", "nlerp"):
        assert apart(call, asset(name), output, "--player", player)["max_error_percent"] <= 0.1


def test_a_kept_node_stays_exact(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = fixture("biped"), tmp_path / "out.glb"
    run = call("optimize", source, output, "--max-error", "1%", "--keep-node", "hips", "--clip", "w*", *FAST)
    assert run.code == 0, run.err
    document = opened_path(source)
    number = reader.skeleton(document).names.index("hips")
    for old, new in zip(reader.clips(document), reader.clips(opened_path(output)), strict=True):
        kept = {track.target: track for track in new.tracks if track.node == number}
        for track in old.tracks:
            if track.node == number:
                found = kept[track.target]
                assert set(found.times) <= set(track.times)
                assert (found.values == track.values[[list(track.times).index(t) for t in found.times]]).all()


# What is left alone


@pytest.mark.parametrize("options", [(), ("--meshopt", "ext"), ("--drop", "rest", "--drop-invisible")])
@pytest.mark.parametrize("name", ["noop", "morph_cube", "pointer", "accessors"])
def test_nothing_else_changes(
    name: str, options: tuple[str, ...], fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    """Meshes, skins and images keep their numbers' bytes, though accessors may close up under them."""
    source, output = fixture(name), tmp_path / "out.glb"
    assert call("optimize", source, output, "--max-error", "0.1%", *FAST, *options).code == 0
    old, new = opened_path(source), opened_path(output)
    moving = ("animations", "asset", "meshes", "skins", "images", "extensionsUsed", "extensionsRequired")
    assert around(new.json, *moving) == around(old.json, *moving)
    extras = {**new.json["asset"].get("extras", {})}
    extras.pop(KEY, None)  # none on a file that came back as it was
    assert {**new.json["asset"], "extras": extras or None} == {
        **old.json["asset"],
        "extras": old.json["asset"].get("extras"),
    }
    assert [each.get("name") for each in new.json["animations"]] == [
        each.get("name") for each in old.json["animations"]
    ]
    for a, b in zip(reader.scene(old).instances, reader.scene(new).instances, strict=True):
        assert (a.node, a.mesh.name) == (b.node, b.mesh.name)
        for part in ("positions", "faces", "joints", "weights", "targets", "rest_weights"):
            assert (getattr(a.mesh, part) == getattr(b.mesh, part)).all(), part
    used = set(new.json.get("extensionsUsed", ())) - set(old.json.get("extensionsUsed", ()))
    assert used <= ({"EXT_meshopt_compression"} if "ext" in options else set())


def test_only_chosen_clips_change(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = fixture("biped"), tmp_path / "out.glb"
    run = call("optimize", source, output, "--clip", "wave", "--max-error", "0.5%", "-v", *FAST)
    assert [line.split("'")[1] for line in run.err.splitlines() if line.startswith("  clip")] == ["wave"]
    by_name = {each["clip"]: each["max_error_m"] for each in apart(call, source, output)["clips"]}
    assert by_name.pop("wave") > 0
    assert set(by_name.values()) == {0.0}
    again = call("optimize", output, "-n", "--max-error", "0.5%", *FAST)
    assert "unchanged" not in again.err  # all clips were not optimized before


def test_every_clip_survives(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = fixture("noop"), tmp_path / "out.glb"
    assert call("optimize", source, output, "--drop", "rest", "--max-error", "50%", *FAST).code == 0
    old, new = (reader.clips(opened_path(path)) for path in (source, output))
    assert [(each.name, each.start, each.end) for each in new] == [(each.name, each.start, each.end) for each in old]
    assert all(each.tracks for each in new)


def test_a_dry_run_writes_nothing(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source = fixture("noop")
    before = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    for options in ((), ("--report", tmp_path / "report.json"), ("--curve", tmp_path / "curve.csv")):
        run = call("optimize", source, tmp_path / "out.glb", "--dry-run", *options, *FAST)
        assert (run.code, run.out) == (0, b"")
        assert ("(dry run: nothing written)" in run.err) is ("--curve" not in options)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before


def test_a_gltf_gets_its_bin(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    output = tmp_path / "out.gltf"
    assert call("optimize", fixture("noop"), output, *FAST).code == 0
    assert (tmp_path / "out.bin").is_file()
    assert apart(call, fixture("noop"), output)["max_error_percent"] <= 0.01


@pytest.mark.slow
def test_a_gltf_beside_its_source_is_optimized_too(tmp_path: Path, fixture: Fixture, call: Call) -> None:
    """What counts is the .gltf with its .bin, wherever that lies."""
    assert call("convert", fixture("biped"), tmp_path / "a.gltf").code == 0
    source_size = sum((tmp_path / name).stat().st_size for name in ("a.gltf", "a.bin"))
    options = ("--max-error", "2mm", *FAST, "--report", tmp_path / "report.json")
    for output in (tmp_path / "b.gltf", tmp_path / "c" / "b.gltf", tmp_path / "a.gltf"):
        output.parent.mkdir(exist_ok=True)
        run = call("optimize", tmp_path / "a.gltf", output, *options)
        assert (run.code, "unchanged" in run.err) == (0, False), run.err
        buffer = json.loads(output.read_bytes())["buffers"][0]["uri"]
        size = output.stat().st_size + (output.parent / buffer).stat().st_size
        said = json.loads((tmp_path / "report.json").read_text())["bytes"]
        assert (said["before"]["file"], said["after"]["file"]) == (source_size, size)
        assert size < 0.95 * source_size


def test_images_go_along(tmp_path: Path, asset: Find, call: Call) -> None:
    run = call("optimize", asset("CesiumMan-gltf/CesiumMan.gltf"), tmp_path / "out.gltf", *FAST)
    assert run.code == 0
    assert "1 image copied beside the output" in run.err


def test_lengths_without_a_unit_are_said_to_be_metres(fixture: Fixture, call: Call) -> None:
    run = call("optimize", fixture("noop"), "-", "--max-error", "0.1", *FAST)
    assert "warning: --max-error 0.1 means 0.1 m" in run.err
    assert "warning" not in call("optimize", fixture("noop"), "-", "--max-error", "0", *FAST).err


# The same again


@pytest.mark.parametrize(
    "options", [(), ("--meshopt", "khr"), ("--rebase-rest", "--drop", "rest"), ("--max-error", "0")]
)
@pytest.mark.parametrize("name", ["noop", "interpolations", "morph_cube"])
def test_its_own_output_stays_as_it_is(
    name: str, options: tuple[str, ...], fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    once, twice = tmp_path / "once.glb", tmp_path / "twice.glb"
    for source, output in ((fixture(name), once), (once, twice)):
        run = call("optimize", source, output, *FAST, *options)
        assert run.code == 0, run.err
    assert twice.read_bytes() == once.read_bytes()
    assert "unchanged" in run.err


def test_a_moved_rest_pose_is_the_same_request_still(tmp_path: Path, fixture: Fixture, call: Call) -> None:
    """It has another diagonal, of which the bound is a share."""
    once, twice = tmp_path / "once.glb", tmp_path / "twice.glb"
    options = ("--rebase-rest", "--drop", "rest", "--max-error", "1%", *FAST)
    first = call("optimize", fixture("biped"), once, *options)
    assert "rest value" in first.err
    again = call("optimize", once, twice, *options)
    assert "optimized like this before" in again.err
    assert twice.read_bytes() == once.read_bytes()
    assert "optimized before" in call("optimize", once, twice, *options, "--max-error", "1.01%").err


def test_a_file_may_be_its_own_output(fixture: Fixture, call: Call) -> None:
    path = fixture("noop")
    source = path.read_bytes()
    assert call("optimize", path, path, *FAST).code == 0
    assert len(path.read_bytes()) < len(source)


def test_another_bound_on_its_own_output_says_from_where_it_counts(
    fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    once, twice = tmp_path / "once.glb", tmp_path / "twice.glb"
    words = "optimized before; errors are measured from it"
    assert words not in call("optimize", fixture("noop"), once, *FAST).err
    assert words in call("optimize", once, twice, "--max-error", "1%", *FAST).err
    assert words in call("optimize", once, twice, "--max-error", "0", *FAST).err
    assert words not in call("optimize", once, twice, *FAST).err  # unchanged: optimized like this before


def test_never_a_file_that_grew(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """What is optimized already, under another bound, and so a mark that says so: smaller or just the same."""
    path = fixture("arm")
    for i, bound in enumerate(("0.01%", "0.1%", "0.001%", "0")):
        output = tmp_path / f"{i}.glb"
        assert call("optimize", path, output, "--max-error", bound, *FAST).code == 0
        assert output.stat().st_size <= path.stat().st_size
        path = output


def test_never_larger_than_without_loss(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """Lines take more bytes than these few splines, whatever they may miss."""
    sizes = []
    for bound in ("0", "0.1%", "1%"):
        assert call("optimize", fixture("interpolations"), tmp_path / "out.glb", "--max-error", bound, *FAST).code == 0
        sizes.append((tmp_path / "out.glb").stat().st_size)
    assert max(sizes[1:]) <= sizes[0]


def test_the_same_bytes_for_any_number_of_jobs(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_optimizer, "MIN_PARALLEL_KEYS", 0)  # several processes, however little there is to do
    for jobs in ("1", "2"):
        run = call("optimize", fixture("noop"), tmp_path / f"{jobs}.glb", "--max-error", "1%", "-j", jobs, *FAST)
        assert run.code == 0, run.err
    assert (tmp_path / "1.glb").read_bytes() == (tmp_path / "2.glb").read_bytes()
