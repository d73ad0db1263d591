"""`from-euler`: BVH, CSV and JSON become glTF that the Khronos validator takes, in pipes and files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from anim.exchange.formats import bvh_reader
from anim.gltf.reading import reader
from tests import khronos
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.curve_files import CURVES, SMALL, XYZ, valid
from tests.cli.running import Run, help_line, refusal, shell
from tests.files import opened, opened_path


@pytest.mark.parametrize("mesh", ["none", "sticks"])
def test_a_bvh_through_a_pipe(call: Call, mesh: str) -> None:
    run = call("from-euler", "-", "-", "--skeleton-mesh", mesh, stdin=SMALL)
    document = opened(run.product())
    valid(run.out)
    bones, clip = reader.skeleton(document), reader.clips(document)[0]
    assert bones.names[:3] == ("hip", "knee", "knee_end")
    assert clip.name == "motion"
    assert {(track.node, track.path) for track in clip.tracks} == {(0, "translation"), (0, "rotation"), (1, "rotation")}
    assert len(reader.scene(document).instances) == (mesh == "sticks")
    assert document.json["asset"]["generator"].startswith("gltf-anim")


def test_two_figures_in_a_bvh(call: Call) -> None:
    """One skin for both would have no common root, which no validator takes."""
    head, _, body = SMALL.decode().partition("MOTION")
    roots = head.partition("\n")[2]
    rows = "\n".join(f"{row} {row}" for row in body.strip().splitlines()[2:])
    text = f"HIERARCHY\n{roots}{roots.replace('hip', 'pelvis')}MOTION\nFrames: 2\nFrame Time: 0.1\n{rows}\n"
    run = call("from-euler", "-", "-", "--skeleton-mesh", "sticks", stdin=text.encode())
    document = opened(run.product())
    valid(run.out)
    assert [skin["joints"] for skin in document.json["skins"]] == [[0, 1], [3, 4]]
    assert "names that appear twice got numbers: knee.2" in run.err


def test_it_says_what_it_guessed(call: Call) -> None:
    err = call("from-euler", "-", "-", stdin=SMALL.replace(b"0.033333", b"0.03334")).err
    assert "frame time 0.03334 s is taken for 1/30 s" in err
    assert "guessed: centimeters" in err
    assert "gimbal: 1 of 2 joints within 5° of lock; nearest 'knee'" in err
    quiet = call("from-euler", "-", "-", "-q", stdin=SMALL.replace(b"0.033333", b"0.03334")).err.splitlines()
    assert [line.split(":")[0] for line in quiet] == ["warning"] * 2


def test_a_t_pose_at_the_first_frame_is_a_warning(call: Call) -> None:
    """And `trim` with the time that it states leaves the motion alone."""
    rows = "\n".join(f"0 90 0 {k} 0 0 {40 + k} 0 0" for k in range(20))
    head = SMALL.partition(b"Frames")[0].decode()
    text = f"{head}Frames: 21\nFrame Time: 0.0333333\n0 90 0 -60 0 0 0 0 0\n{rows}\n".encode()
    run = call("from-euler", "-", "-", stdin=text)
    made = run.product()
    said = "2 joints jump to the next one, 'hip' by 60° (`trim --from 0.033333335 --rebase` removes it from the clip)"
    assert f"warning: the first frame is a pose apart from the motion: {said}" in run.err
    rest = call("trim", "-", "-", "--from", "0.033333335", "--rebase", stdin=made).product()
    before, after = (reader.clips(opened(data))[0] for data in (made, rest))
    for whole, track in zip(before.tracks, after.tracks, strict=True):
        if len(whole.times) > 1:
            np.testing.assert_array_equal(track.values, whole.values[1:])
    plain = call("from-euler", "-", "-", stdin=text.replace(b"-60 0 0 0 0 0", b"-1 0 0 39 0 0"))
    assert "apart from the motion" not in plain.err


def test_a_late_clip_is_as_long_as_its_keys(call: Call) -> None:
    late = CURVES.replace(b"\n0,", b"\n5000,").replace(b"\n1,", b"\n5001,")
    run = call("from-euler", "-", "-", *XYZ, stdin=late)
    assert ", 1 s long" in run.err
    assert "at 5001 s" in run.err
    report = json.loads(call("from-euler", "-", "/dev/null", *XYZ, "--format", "json", stdin=late).out)
    assert report["duration_s"] == 1


def test_scale_and_up(call: Call) -> None:
    document = opened(call("from-euler", "-", "-", "--scale", "0.5", "--up", "z", stdin=SMALL).product())
    np.testing.assert_allclose(reader.skeleton(document).translation[1], (0, 0, 42.5), atol=1e-6)


def test_a_giant_is_told(call: Call) -> None:
    giant = b"#node,hips,,0,95,0\n#node,head,hips,0,80,0\n" + CURVES.replace(b"door", b"head")
    assert "scale: skeleton height 80 m (--scale 0.01" in call("from-euler", "-", "-", *XYZ, stdin=giant).err


def test_csv_keys_follow_the_motion(call: Call) -> None:
    run = call("from-euler", "-", "-", *XYZ, "--angle-tolerance", "0.1deg", stdin=CURVES)
    valid(run.out)
    assert 3 < len(reader.clips(opened(run.product()))[0].tracks[0].times) <= 17


def test_the_range_of_angles_shows_a_wrong_unit(call: Call) -> None:
    assert "angles: 0° to 90°" in call("from-euler", "-", "-", *XYZ, stdin=CURVES).err
    assert "angles: 0° to 5157°" in call("from-euler", "-", "-", *XYZ[:-1], "rad", stdin=CURVES).err
    assert "angles:" not in call("from-euler", "-", "-", stdin=SMALL).err


def test_a_body_without_a_size(call: Call) -> None:
    """Hidden things have a scale of 0, whose matrix has no inverse."""
    flat = b"#node,door,,0,0,0,0,0,0,0,1,1\n#node,knob,door,1,0,0\n" + CURVES
    valid(call("from-euler", "-", "-", *XYZ, "--skeleton-mesh", "sticks", stdin=flat).product())


def test_an_order_in_small_letters_and_keys_before_zero(call: Call) -> None:
    early = CURVES.replace(b"\n0,", b"\n-0.04,")
    run = call("from-euler", "-", "-", "--order", "xyz", *XYZ[2:], stdin=early)
    assert "warning: the first key is at -0.04 s: all are moved by 0.04 s, to begin at 0" in run.err
    assert reader.clips(opened(run.product()))[0].end == pytest.approx(1.04)


def test_a_gltf_with_its_bin(call: Call, tmp_path: Path) -> None:
    assert call("from-euler", "-", tmp_path / "door.gltf", *XYZ, "--name", "open", stdin=CURVES).code == 0
    assert reader.clips(opened_path(tmp_path / "door.gltf"))[0].name == "open"


@pytest.mark.parametrize("name", ["cmu_01_01.bvh", "freebvh.bvh", "example.bvh"])
def test_real_files_are_valid(name: str, call: Call, asset: Find) -> None:
    run = call("from-euler", asset(f"bvh/{name}"), "-", "--skeleton-mesh", "sticks")
    document = opened(run.product())
    valid(run.out)
    assert reader.clips(document)[0].name == name.removesuffix(".bvh")
    nodes = bvh_reader.read(asset(f"bvh/{name}").read_bytes()).nodes
    assert len(document.json["skins"][0]["joints"]) == sum(not node.end for node in nodes)


def test_the_report_as_json(call: Call, tmp_path: Path) -> None:
    run = call("from-euler", "-", tmp_path / "a.glb", "--format", "json", stdin=SMALL)
    report = run.json
    assert (report["schema"], report["joints"], report["meters_per_unit"]) == (1, 2, 0.01)
    assert {"node", "nearest_deg", "near_s", "worst_condition", "best_order"} <= report["gimbal"][0].keys()
    assert (tmp_path / "a.glb").is_file()
    dry = call("from-euler", "-", "-", "--format", "json", "--dry-run", stdin=SMALL)
    assert dry.json["gimbal"] == report["gimbal"]


@pytest.mark.parametrize(
    ("args", "data", "code", "words"),
    [
        ((), SMALL.replace(b"90 0 90 0", b"90 0 nan 0"), 3, "stdin: line 20: number 8 is 'nan'"),
        ((), SMALL.replace(b"Frames: 2", b"Frames: 1000000000"), 3, "line 20: the file holds 2 of 1000000000"),
        ((), SMALL[:200], 3, "line "),
        ((), b"", 3, "stdin: is empty"),
        ((), b"glTF\2\0\0\0", 3, "stdin: is a glTF already"),
        ((), b'{"asset": {"version": "2.0"}}', 3, "stdin: is a glTF already"),
        (
            (),
            SMALL[: SMALL.index(b"Zrot") + 4],
            3,
            "line 5: unknown channel 'Zrot' (expected Xposition … Zrotation; truncated?)",
        ),
        ((), b"\x89PNG\r\n", 3, "stdin: starts with"),
        (XYZ, SMALL, 2, "--order, --axes and --unit do not apply to a BVH, which specifies the order"),
        ((), CURVES, 2, "rotation order not specified"),
        (XYZ, CURVES.replace(b"1,90", b"1,9O"), 3, "stdin: line 3: door.rx is '9O'"),
        (XYZ, CURVES.replace(b"door.rz", b"door.rq"), 3, "stdin: line 1: "),
        (("--angle-tolerance", "0"), SMALL, 2, "--angle-tolerance is '0'"),
        (("--angle-tolerance", "1mm"), SMALL, 2, "--angle-tolerance is '1mm'"),
        (("--scale", "0"), SMALL, 2, "--scale is 0"),
        (("--scale", "1e-13"), SMALL, 2, "--scale is 1e-13 (expected 1e-12 to 1e+15)"),
        (("--fail-unmatched", "0"), SMALL, 2, "require --onto (the character)"),
        (("--bind-time", "0"), SMALL, 2, "require --onto (the character)"),
        (("--replace", "walk"), SMALL, 2, "require --onto (the character)"),
        (("--format", "json"), SMALL, 2, "both want stdout"),
        (("--onto", "-"), SMALL, 2, "SOURCE and --onto can't both be stdin"),
        ((*XYZ, "--bvh-position", "add"), CURVES, 2, "--bvh-position does not apply to curves without OFFSET"),
        (("--onto", "nobody.glb"), SMALL, 3, "nobody.glb: can't be read"),
        (("--order", "XXY"), SMALL, 2, "--order is 'XXY' (expected one of XYZ,"),
    ],
)
def test_refusals(call: Call, args: tuple[str, ...], data: bytes, code: int, words: str) -> None:
    assert words in refusal(call("from-euler", "-", "-", *args, stdin=data), code)


def test_a_folder_is_refused_with_a_way_out(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("from-euler", tmp_path, "--dry-run")
    assert refusal(run, 3) == f"gltf-anim: {tmp_path}: is a folder"
    assert help_line(run) == "name a file (there is no .bvh in it)"
    run = call("from-euler", "-", "--onto", fixture("biped"), "--alias", tmp_path, "--dry-run", stdin=SMALL)
    assert refusal(run, 3) == f"gltf-anim: {tmp_path}: is a folder"
    assert help_line(run) == "name a file (there is no .csv in it)"
    run = call("from-euler", "-", "--onto", tmp_path, "--dry-run", stdin=SMALL)
    assert help_line(run) == f"name a file in it, such as {tmp_path / 'biped.glb'}"


def test_a_rest_pose_must_be_in_the_motion(call: Call, fixture: Fixture, asset: Find) -> None:
    run = call("from-euler", asset("bvh/example.bvh"), "-", "--onto", fixture("biped"), "--bind-time", "9")
    assert "bind time 9 s is outside the motion (expected 0 to 0.03333 s)" in refusal(run, 2)


def test_sticks_and_a_character_exclude_each_other(call: Call, fixture: Fixture) -> None:
    run = call("from-euler", "-", "-", "--onto", fixture("biped"), "--skeleton-mesh", "sticks", stdin=SMALL)
    assert "--skeleton-mesh makes a body" in refusal(run, 2)


def test_dry_run_writes_nothing(call: Call, tmp_path: Path) -> None:
    run = call("from-euler", "-", tmp_path / "a.glb", "--dry-run", stdin=SMALL)
    assert run.code == 0
    assert "nothing written" in run.err
    assert not list(tmp_path.iterdir())


def test_same_bytes_twice(call: Call) -> None:
    runs: list[Run] = [call("from-euler", "-", "-", "--skeleton-mesh", "sticks", stdin=SMALL) for _ in range(2)]
    assert runs[0].product() == runs[1].product()


def test_in_a_shell_pipe(tmp_path: Path) -> None:
    (tmp_path / "small.bvh").write_bytes(SMALL)
    run = shell(
        "gltf-anim from-euler small.bvh | gltf-anim to-euler --order ZXY | gltf-anim from-euler -q | wc -c", tmp_path
    )
    assert run.code == 0, run.err
    assert int(run.text) > 500


@khronos.needs_validator
def test_a_joint_with_a_matrix_is_taken_apart_when_it_gets_keys(call: Call, asset: Find, tmp_path: Path) -> None:
    character, out = asset("RiggedSimple.gltf"), tmp_path / "out.glb"
    call("to-euler", character, tmp_path / "m.json", "--order", "XYZ", "--axes", "intrinsic").product()
    call("from-euler", tmp_path / "m.json", out, "--onto", character).product()
    assert khronos.errors(khronos.validate(out.read_bytes())) == []
    assert call("inspect", out).code == 0
    whole = [node for node in json.loads(character.read_text())["nodes"] if "matrix" in node]
    animated = {n["name"] for n in opened_path(out).json["nodes"] if "matrix" not in n}
    assert len(whole) > len([node for node in whole if node["name"] in animated]) > 0  # others keep theirs


def test_the_table_of_joints_has_a_line_for_each(call: Call) -> None:
    err = call("from-euler", "-", "-", "-v", stdin=SMALL).err
    table = err[err.index("locked axes") :].splitlines()
    assert "\\n" not in err
    assert [line.split()[0] for line in table[1:3]] == ["hip", "knee"]
