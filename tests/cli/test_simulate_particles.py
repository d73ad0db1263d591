"""`gltf-anim simulate particles` as a user runs it: forms, points, reports, loops, obstacles."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import anim
from anim.sampling.track import sample
from tests.anim.simulation.rigid_bodies.cases import collider, document, node
from tests.cli.conftest import Call, Fixture
from tests.cli.playing import Player
from tests.judge import judge, needs_judge, vertices
from tests.khronos import errors, needs_validator, validate

SPARKS = ("--node", "head", "--floor", "0", "--rate", "30", "--duration", "1")


def simulate(call: Call, *args: object) -> str:
    run = call("simulate", "particles", *args)
    assert run.code == 0, run.err
    return run.err


@needs_validator
def test_a_skin_moves_its_vertices_as_the_nodes_move_their_mesh(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    paths = {form: tmp_path / f"{form}.glb" for form in ("node", "skin")}
    for form, path in paths.items():
        simulate(call, fixture("biped"), path, *SPARKS, "--as", form)
        assert errors(validate(path.read_bytes())) == []
    nodes, skin = (Player(path.read_bytes()) for path in paths.values())
    clip = skin.names().index("particles")
    own = skin.document["skins"][-1]
    joints = own["joints"]
    mesh = skin.document["meshes"][-1]["primitives"][0]
    assert len(skin.document["accessors"]) > 0
    binds = np.array(_decode(skin, own["inverseBindMatrices"])).reshape(-1, 4, 4)
    points = np.array(_decode(skin, mesh["attributes"]["POSITION"])).reshape(len(joints), 6, 3)
    for time in (0.0, 0.31, 0.77, 1.0):
        world, one = skin.world(clip, time), nodes.world(clip, time)
        for i, joint in enumerate(joints):
            matrix = world[joint] @ binds[i]
            moved = points[i] @ matrix[:3, :3].T + matrix[:3, 3]
            own_node = one[nodes.node(skin.nodes[joint]["name"])]
            corners = np.array(_decode(nodes, nodes.document["meshes"][-1]["primitives"][0]["attributes"]["POSITION"]))
            expected = corners.reshape(-1, 3) @ own_node[:3, :3].T + own_node[:3, 3]
            np.testing.assert_allclose(moved, expected, atol=2e-6)


@pytest.mark.slow
@needs_judge
def test_three_js_shows_both_forms_alike(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    paths = [tmp_path / f"{form}.glb" for form in ("node", "skin")]
    for path in paths:
        simulate(call, fixture("biped"), path, *SPARKS, "--as", path.stem)
    clip = Player(paths[0].read_bytes()).names().index("particles")
    for time in (0.0, 0.4, 1.0):
        a, b = (vertices(path, clip=clip, time=time) for path in paths)
        assert len(a) == len(b) > 0
        np.testing.assert_allclose(a, b, atol=2e-6)


@pytest.mark.slow
@needs_judge
@pytest.mark.parametrize("form", ["node", "skin"])
def test_three_js_measures_the_error_of_removed_keys(form: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    args = (*SPARKS, "--drag", "1", "--turbulence", "1", "--as", form)
    simulate(call, fixture("biped"), tmp_path / "full.glb", *args)
    simulate(call, fixture("biped"), tmp_path / "few.glb", *args, "--max-error", "1mm")
    found = judge(tmp_path / "full.glb", tmp_path / "few.glb")
    assert 1e-5 < max(each.max_error for each in found.clips) <= 1.001e-3


@pytest.mark.parametrize(("ending", "words"), [(".npz", "holds points without faces"), (".usda", "are no mesh")])
def test_points_are_no_vertex_cache(ending: str, words: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    simulate(call, fixture("biped"), tmp_path / f"a{ending}", *SPARKS)
    run = call("render", tmp_path / f"a{ending}", tmp_path / "a.png")
    assert run.code == 3
    assert words in run.err


def test_two_driving_clips_are_listed_without_an_ellipsis(fixture: Fixture, call: Call) -> None:
    run = call("simulate", "particles", fixture("biped"), "-", "--node", "head", "--clip", "w*")
    assert (run.code, run.out) == (2, b"")
    assert "names 2 clips (clip 'walk', clip 'wave'): one" in run.err


def test_more_than_two_thousand_nodes_are_warned_of(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    said = simulate(call, fixture("flag"), tmp_path / "out.glb", "--node", "pole", "--rate", "0", "--burst", "2001")
    assert "warning: 2001 nodes: players take about a second" in said
    run = call("simulate", "particles", fixture("flag"), "-", "--node", "pole", "--rate", "0", "--burst", "10001")
    assert (run.code, run.out) == (4, b"")
    assert "limit 10000 nodes" in run.err


def _decode(player: Player, accessor: int) -> object:
    from tests.fixtures.reading import decode

    return decode(player.document, player.blob, accessor)


def test_points_in_a_npz_are_where_the_nodes_are(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    simulate(call, fixture("biped"), tmp_path / "a.glb", *SPARKS)
    simulate(call, fixture("biped"), tmp_path / "a.npz", *SPARKS)
    clip = anim.load(tmp_path / "a.glb").clips["particles"]
    tracks = [track for track in clip.tracks if track.path == "translation"]
    sizes = [track for track in clip.tracks if track.path == "scale"]
    with np.load(tmp_path / "a.npz") as points:
        assert json.loads(str(points["meta"]))["schema"] == "points/1"
        for frame, time in enumerate(points["times"][:-1] + 1e-6):  # births are rounded to float32 in the file
            alive = points["positions"][points["offsets"][frame] : points["offsets"][frame + 1]]
            shown = np.array(
                [
                    sample(track, np.array([time]))[0]
                    for track, size in zip(tracks, sizes, strict=True)
                    if sample(size, np.array([time]))[0, 0] > 0
                ]
            ).reshape(-1, 3)
            np.testing.assert_allclose(
                alive[np.lexsort(alive.T.round(4))], shown[np.lexsort(shown.T.round(4))], atol=1e-5
            )
        assert (points["ages"] >= 0).all()
        assert (points["ages"] < points["lifetimes"]).all()


@pytest.mark.parametrize("ending", ["usdc", "usda"])
def test_usd_reads_the_points(ending: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    geom = pytest.importorskip("pxr.UsdGeom")
    simulate(call, fixture("biped"), tmp_path / f"a.{ending}", *SPARKS, "--size", "2cm")
    simulate(call, fixture("biped"), tmp_path / "a.npz", *SPARKS, "--size", "2cm")
    stage = usd.Stage.Open(str(tmp_path / f"a.{ending}"))
    prim = geom.Points(stage.GetDefaultPrim())
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (60, 60)
    with np.load(tmp_path / "a.npz") as points:
        for frame in (0, 17, 60):
            rows = slice(points["offsets"][frame], points["offsets"][frame + 1])
            np.testing.assert_array_equal(np.array(prim.GetIdsAttr().Get(frame)), points["ids"][rows])
            np.testing.assert_array_equal(np.array(prim.GetPointsAttr().Get(frame)), points["positions"][rows])
            widths = np.array(prim.GetWidthsAttr().Get(frame))
            np.testing.assert_allclose(widths, np.full(len(points["ids"][rows]), 0.04), rtol=1e-6)
            age = geom.PrimvarsAPI(prim).GetPrimvar("age").Get(frame)
            np.testing.assert_array_equal(np.array(age), points["ages"][rows])


def test_removed_keys_leave_every_track_within_the_bound(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    air = ("--drag", "1", "--turbulence", "0.5")
    simulate(call, fixture("biped"), tmp_path / "full.glb", *SPARKS, *air)
    said = simulate(call, fixture("biped"), tmp_path / "few.glb", *SPARKS, *air, "--max-error", "1mm")
    assert "keys with an error of" in said
    full, few = (anim.load(tmp_path / name).clips["particles"] for name in ("full.glb", "few.glb"))
    assert sum(len(t.times) for t in few.tracks) < 0.5 * sum(len(t.times) for t in full.tracks)
    times = np.linspace(0, 1, 997)
    for a, b in zip(full.tracks, few.tracks, strict=True):
        if a.path == "translation":
            distance = np.linalg.norm(sample(a, times) - sample(b, times), axis=1)
            assert distance.max() < 1.001e-3


def test_an_attractor_on_a_node_pulls_and_an_obstacle_follows_it(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    args = ("--attractor", "left_hand:20:20cm", "--sphere", "left_hand,0.05", "--gravity", "0,0,0", "--report", report)
    node = _hand(fixture)
    swapped = [str(each).replace("left_hand", node) for each in args]
    simulate(call, fixture("biped"), tmp_path / "out.glb", *SPARKS, *swapped)
    found = json.loads(report.read_text())
    assert found["omega_h"] == pytest.approx(np.sqrt(20 / 0.2) / 240)
    assert found["omega_h_limit"] == 2
    assert found["penetration_m"] < 1e-6
    assert found["energy_j"]["peak"] >= found["energy_j"]["end"]


def _hand(fixture: Fixture) -> str:
    names = anim.load(fixture("biped")).skeleton.names
    return next(name for name in names if "hand" in name.lower())


@pytest.mark.parametrize("air", [(), ("--drag", "1", "--turbulence", "1", "--wind", "1,0,0")])
def test_a_loop_reports_a_seam_of_nothing(air: tuple[str, ...], fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    moving = ("--sphere", f"{_hand(fixture)},0.1", "--attractor", f"{_hand(fixture)}:3")
    said = simulate(call, fixture("biped"), tmp_path / "a.glb", *SPARKS, *air, *moving, "--loop", "--report", report)
    assert "seam of the loop" in said
    assert json.loads(report.read_text())["loop_seam_m"] < 1e-6


def test_a_warm_up_begins_with_particles(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    for name, more in (("cold", ()), ("warm", ("--warm-up", "1"))):
        simulate(call, fixture("biped"), tmp_path / f"{name}.npz", *SPARKS, *more)
    with np.load(tmp_path / "cold.npz") as cold, np.load(tmp_path / "warm.npz") as warm:
        assert cold["offsets"][1] == 1
        assert warm["offsets"][1] > 20
        assert cold["times"][-1] == warm["times"][-1] == 1


@pytest.mark.parametrize("ending", ["json", "png"])
def test_particles_that_diverge_end_with_a_report_and_advice_that_works(
    ending: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out, report = tmp_path / "out.glb", tmp_path / f"report.{ending}"
    args = (*SPARKS, "--drag", "300", "--integrator", "explicit-euler", "--report", report)
    run = call("simulate", "particles", fixture("biped"), out, *args, "--step", "1/60")
    assert (run.code, out.exists(), report.exists()) == (6, False, True), run.err
    assert "diverges in step" in run.err
    assert "help: drag·h = 5, explicit-euler's limit is 2: --step 1/" in run.err
    if ending == "json":
        assert json.loads(report.read_text())["first_bad_step"] > 0
    step = run.err.split("--step ")[1].split()[0]
    simulate(call, fixture("biped"), out, *args, "--step", step)


def test_the_picture_is_of_this_run(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.svg"
    simulate(call, fixture("biped"), tmp_path / "out.glb", *SPARKS, "--drag", "60", "--report", report)
    assert "drag·h = 0.25" in report.read_text()


def test_threads_change_no_byte(fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = []
    for count in ("1", "2"):
        for name in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "GLTF_ANIM_THREADS"):
            monkeypatch.setenv(name, count)
        simulate(call, fixture("biped"), tmp_path / "a.glb", *SPARKS, "--drag", "1", "--turbulence", "1")
        written.append((tmp_path / "a.glb").read_bytes())
    assert written[0] == written[1]


@pytest.mark.parametrize(
    ("args", "code", "words"),
    [
        (("--rate", "-1"), 2, "--rate"),
        (("--mass", "0"), 2, "--mass is 0"),
        (("--mass", "-1"), 2, "--mass is -1"),
        (("--attractor", "head"), 2, "expected NODE:STRENGTH"),
        (("--attractor", "tail:3"), 5, "no node"),
        (("--attractor", "head:3:0m"), 2, "--attractor is '0m'"),
        (("--sphere", "head"), 2, "expected NODE,R or X,Y,Z,R"),
        (("--sphere", "*,1"), 2, "names"),
        (("--box", "head,1,0,1"), 2, "--box is 'head,1,0,1': size is 0 m"),
        (("--max-error", "0mm"), 2, "--max-error"),
        (("--duration", "0"), 2, "--duration is 0"),
        (("--as", "sprite"), 2, "sprite"),
        (("--speed", "1e30"), 2, "--speed is 1e+30"),
        (("--inherit", "-1e30"), 2, "--inherit is -1e+30"),
        (("--gravity", "0,-1e30,0"), 2, "--gravity is 1e+30 m/s²"),
        (("--drag", "1e30"), 2, "--drag is 1e+30"),
        (("--drag", "1", "--turbulence", "1e30"), 2, "--turbulence is 1e+30"),
    ],
)
def test_options_without_sense_are_refused_in_one_line(
    args: tuple[str, ...], code: int, words: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out = tmp_path / "out.glb"
    run = call("simulate", "particles", fixture("biped"), out, "--node", "head", *args)
    assert (run.code, out.exists()) == (code, False), run.err
    assert words in run.err
    assert len(run.err.splitlines()) <= 2


def test_no_emitter_is_refused(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    run = call("simulate", "particles", fixture("biped"), tmp_path / "out.glb")
    assert run.code == 2
    assert "--node" in run.err


def test_colliders_of_the_file_of_rigid_bodies_and_of_options_stop_particles(
    fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    colliders = tmp_path / "colliders.json"
    ball = {"node": "head", "sphere": {"radius": 0.3}}
    colliders.write_text(json.dumps({"schema": "spring-bones/1", "colliders": [ball]}))
    made = document(
        [
            node((0, 2, 0)),
            node((0, 0.5, 0), collider=collider(0)),
            node(collider=collider(1)),
            node((9, 0, 0), collider=collider(2)),
        ],
        [{"type": "box", "box": {"size": [4, 1, 4]}}, {"type": "plane"}, {"type": "cylinder"}],
    )
    own = tmp_path / "bodies.gltf"
    own.write_text(json.dumps(made.json))
    common = ("--rate", "30", "--speed", "1", "--duration", "1.5")
    for source, options in (
        (fixture("biped"), ("--colliders", colliders, "--node", "head")),
        (fixture("ponytail"), ("--colliders", "vrm", "--node", "*")),
        (fixture("biped"), ("--capsule", "hips,head,0.3", "--node", "head")),
        (fixture("biped"), ("--plane", "0,0,0,0,1,0.2", "--node", "head")),
        (own, ("--colliders", "khr", "--node", "0")),
    ):
        report = tmp_path / "report.json"
        words = simulate(call, source, tmp_path / "out.glb", *common, *options, "--report", report)
        found = json.loads(report.read_text())
        assert found["impacts"] + found["born_inside"] > 0, options
        assert ("is no sphere, box, capsule or plane" in words) == ("khr" in options)
