"""Inputs that once ended in a traceback, a wrong exit code, or a message without end."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cli.io.output_names import expand
from fixtures.broken.pieces import animated, buffered, text
from tests.cli.conftest import Call, Find
from tests.cli.running import ENVIRONMENT, Run, built, help_line, refusal, shell

DIGITS = "9" * 5000
BVH = """HIERARCHY
ROOT hip
{
OFFSET 0 0 0
CHANNELS 3 Zrotation Xrotation Yrotation
End Site
{
OFFSET 0 1 0
}
}
MOTION
Frames: 2
Frame Time: 0.1
0 0 0
1 2 3
"""
LINES = (  # of a glTF file, with codes 0 and 3 only
    "resample IN out.glb --fps 4",
    "resample IN out.glb --fps 4 --interpolation cubicspline",
    "optimize IN out.glb --effort fast --jobs 1",
    "diff IN IN",
    "spline IN out.glb",
    "ease IN out.glb",
    "retime IN out.glb --warp sine-in-out",
    "loop IN",
    "inspect IN",
    "check IN",
    "plot IN out.png",
    "sample IN --fps 4",
)


def run(line: str, path: Path, call: Call) -> Run:
    words = [str(path) if each == "IN" else each for each in line.split()]
    return call(*(str(path.with_name(each)) if each.startswith("out.") else each for each in words))


def check_ends_well(done: Run, codes: tuple[int, ...] = (0, 3)) -> None:
    assert done.code in codes, done.err
    assert "Traceback" not in done.err
    assert "Warning:" not in done.err
    assert all(len(line) < 1100 for line in done.err.splitlines())


def rotation_spline() -> dict[str, Any]:
    """A spline from a rotation to its opposite, through 0."""
    values: list[list[float]] = [[0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, -1], [0, 0, 0, 0]]
    sampler = {"input": 0, "output": 1, "interpolation": "CUBICSPLINE"}
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    return {
        "nodes": [{"name": "a"}],
        "scenes": [{"nodes": [0]}],
        **buffered(("SCALAR", 5126, [0, 1]), ("VEC4", 5126, values)),
        "animations": [{"name": "w", "samplers": [sampler], "channels": [channel]}],
    }


ODD = {
    "one key": animated(times=[0], values=[[0, 0, 0]]),
    "denormal time": animated(times=[0, 1e-45]),
    "first key late": animated(times=[3e38], values=[[0, 0, 0]]),
    "last key late": animated(times=[0, 3e38]),
    "27 hours": animated(times=[0, 1e5]),
    "large values": animated(times=[0, 1, 2], values=[[0.0, 0, 0], [3e38, 0, 0], [-3e38, 0, 0]]),
    "rotations through 0": rotation_spline(),
    "long names": {**animated(), "animations": [{**animated()["animations"][0], "name": "N" * 10**5}]},
}


# Those of many keys, or with a text of 100 000 letters to draw.
SLOW = ("27 hours-resample", "27 hours-spline", "27 hours-sample", "27 hours-optimize", "long names-plot")


def odd_clips() -> Iterator[Any]:
    """Every odd clip with every line."""
    for name in ODD:
        for line in LINES:
            slow = f"{name}-{line.split()[0]}" in SLOW
            yield pytest.param(name, line, id=f"{name}-{line}", marks=[pytest.mark.slow] if slow else [])


@pytest.mark.parametrize(("name", "line"), list(odd_clips()))
@pytest.mark.filterwarnings("ignore:Attempting to set identical")  # of matplotlib, which `main` hides
def test_odd_clips_are_refused_or_done(name: str, line: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(text(ODD[name]))
    check_ends_well(run(line, path, call), (0, 3, 4))


@pytest.mark.parametrize("line", [*LINES, "bake IN out.npz --fps 4", "render IN out.png"])
def test_an_empty_list_of_weights_is_none(line: str, asset: Find, call: Call, tmp_path: Path) -> None:
    document = json.loads(asset("SimpleMorph.gltf").read_text())
    path = tmp_path / "a.gltf"
    for mesh in document["meshes"]:
        mesh["weights"] = []
    for node in document["nodes"]:
        node["weights"] = []
    path.write_text(json.dumps(document))
    check_ends_well(run(line, path, call), (0,))


@pytest.mark.parametrize(
    "data",
    [
        BVH.replace("CHANNELS 3", f"CHANNELS {DIGITS}"),
        BVH.replace("Frames: 2", f"Frames: {DIGITS}"),
        BVH.replace("0.1", "1e-320"),
        BVH.replace("OFFSET 0 1 0", f"OFFSET 0 {DIGITS} 0"),
    ],
    ids=["channels", "frames", "frame time", "offset"],
)
def test_numbers_of_thousands_of_digits_are_refused(data: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text(data)
    refusal(call("from-euler", tmp_path / "a.bvh", tmp_path / "out.glb"), 3)


def test_names_of_thousands_of_digits_are_names(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text(BVH.replace("hip", f"hip{DIGITS}"))
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    done = call("from-euler", tmp_path / "a.bvh", tmp_path / "out.glb", "--onto", tmp_path / "arm.glb")
    check_ends_well(done, (0, 3, 5))


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        ("# gltf-anim time=0\x1cup\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", 0),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 1\nvn 0 0 1\nvn 0 0 1\nf 1//1 2//2 3//3\n", 3),
        (f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {'9' * 30}\n", 3),
        (f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {DIGITS}\n", 3),
        ("v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", 3),
        (f"v 0 0 0\nf {'[]' * 1000}\n", 3),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf\nf /\n", 3),
    ],
)
def test_odd_lines_of_obj(lines: str, code: int, call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(lines)
    check_ends_well(call("convert-cache", tmp_path / "a.obj", tmp_path / "out.npz"), (code,))


@pytest.mark.parametrize("version", ["9.0", "2.1"])
def test_a_file_of_a_later_version_is_refused(version: str, asset: Find, call: Call, tmp_path: Path) -> None:
    document = json.loads(asset("SimpleSkin.gltf").read_text())
    document["asset"]["minVersion"] = version
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    assert f"asset.minVersion: is '{version}'" in refusal(call("convert", tmp_path / "a.gltf", tmp_path / "out.glb"), 3)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("CON", "_CON.npz"),
        ("com1", "_com1.npz"),
        ("nul.txt", "_nul.txt.npz"),
        ("lpt9 ", "_lpt9.npz"),
        ("COM¹", "_COM¹.npz"),
        ("conout$", "_conout$.npz"),
        ("console", "console.npz"),
        ("a" * 300, f"{'a' * 100}.npz"),
        ("ä" * 300, f"{'ä' * 50}.npz"),
        ("..", "7.npz"),
    ],
)
def test_names_of_clips_as_names_of_files(name: str, expected: str) -> None:
    assert expand("{clip}.npz", [{"clip": name}], [7]) == [expected]


def test_a_folder_that_is_not_there_is_no_file_name(call: Call, walk: Path, tmp_path: Path) -> None:
    run = call("resample", walk, f"{tmp_path}/new/", "--fps", "4")
    assert "there is no such folder" in refusal(run, 2)
    assert help_line(run) == f"for a file of the input's name in that folder: -o {tmp_path}/new/"
    assert help_line(call("resample", walk, "it's/", "--fps", "4")).endswith(" -o " + shlex.quote("it's/"))
    assert "help: " not in call("resample", "-", f"{tmp_path}/new/", "--fps", "4", stdin=walk.read_bytes()).err
    assert list(tmp_path.iterdir()) == [walk]
    assert call("resample", walk, "-o", f"{tmp_path}/new/", "--fps", "4").code == 0
    run = call("resample", walk, tmp_path / "new", "--fps", "4")
    assert "new: is a folder (expected a file name)" in refusal(run, 2)
    assert help_line(run).endswith(f"-o {tmp_path}/new/")


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("resample IN out.glb --fps 1e6", 4, "would take"),
        ("sample IN out.npz --fps 1e5", 2, "NPZ holds one clip"),
        ("sample IN out.json --fps 1e6", 4, "would take"),
        ("resample IN out.glb --fps 1e9", 4, "frames at 1e+09 fps"),
        ("resample IN out.glb --fps 1e300", 4, "frames at 1e+300 fps"),
        ("diff IN IN --samples-per-second 1e9", 4, "walk.glb: clip 'walk': 1e+09 frames at 1e+09 fps"),
    ],
)
def test_many_keys_are_counted_before_they_are_computed(
    line: str, code: int, words: str, call: Call, walk: Path
) -> None:
    assert words in refusal(run(line, walk, call), code)


@pytest.mark.parametrize(
    "locale", [pytest.param({}, marks=pytest.mark.slow), {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}]
)
def test_names_beyond_ascii_in_an_ascii_locale(locale: dict[str, str], tmp_path: Path) -> None:
    document = animated()
    document["nodes"][0]["name"] = "Hüfte★"
    document["animations"][0]["name"] = "läuft"
    (tmp_path / "a.gltf").write_bytes(text(document))
    settings = " ".join(f"{key}={value}" for key, value in {"LC_ALL": "C", **locale}.items())
    for line in ("plot a.gltf out.png", "inspect a.gltf", "resample a.gltf out.gltf --fps 4"):
        check_ends_well(shell(f"{settings} gltf-anim {line}", tmp_path), (0,))
    (tmp_path / "arm.glb").write_bytes(built("arm").replace(b'"bend"', '"bä"'.encode().ljust(6)))
    check_ends_well(shell(f"{settings} gltf-anim bake arm.glb '{{clip}}.npz' --fps 4", tmp_path), (0,))


@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full"])
def test_a_refusal_has_its_code_even_unsaid(redirection: str, tmp_path: Path) -> None:
    assert shell(f"gltf-anim convert none.glb out.glb {redirection}", tmp_path).code == 3


@pytest.mark.parametrize("option", ["--help", "--version", "resample --help"])
def test_a_full_disk_takes_no_help(option: str, tmp_path: Path) -> None:
    assert os.environ.keys() & ENVIRONMENT.keys()
    done = shell(f"gltf-anim {option} > /dev/full", tmp_path)
    assert "stdout: can't be written (no space left on device)" in refusal(done, 3)


@pytest.mark.slow
def test_angles_of_many_thousand_turns_are_refused(call: Call, tmp_path: Path) -> None:
    curves = tmp_path / "spin.csv"
    curves.write_text("time,hip.rx,hip.ry,hip.rz\n0,0,0,0\n1,5.4e7,3,4\n2,0,0,0\n")
    options = ("--order", "XYZ", "--axes", "intrinsic", "--unit", "deg")
    done = call("from-euler", str(curves), str(tmp_path / "out.glb"), *options)
    assert done.code == 4
    assert "over 100000 keys" in done.err


@pytest.mark.parametrize("command", ["optimize", "spline"])
def test_a_clip_that_is_too_long_to_measure_is_named(command: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(text(animated(times=[0, 1e6])))
    assert "frames at 120 fps (limit 10000000)" in refusal(call(command, path, tmp_path / "out.glb"), 4)


def test_control_characters_of_names_are_escaped_in_summaries(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    clip = {**animated(times=[0, 1])["animations"][0], "name": "\x1b[31mred\x07"}
    path.write_bytes(text({**animated(times=[0, 1]), "animations": [clip]}))
    run = call("trim", path, tmp_path / "out.glb", "--to", "0.5")
    assert run.code == 0, run.err
    assert "'\\x1b[31mred\\x07'" in run.err
    assert "\x1b" not in run.err


def test_line_breaks_of_names_break_no_line(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    clip = {**animated(times=[0, 1])["animations"][0], "name": "two\nlines"}
    path.write_bytes(text({**animated(times=[0, 1]), "animations": [clip]}))
    run = call("trim", path, tmp_path / "out.glb", "--to", "0.5")
    assert run.code == 0, run.err
    assert "'two\\nlines'" in run.err
    assert len(run.err.splitlines()) == 1


@pytest.mark.parametrize("command", ["trim --to 0.5", "optimize", "resample --fps 5"])
def test_an_extension_that_is_required_and_unknown_is_noted(command: str, call: Call, tmp_path: Path) -> None:
    path, out = tmp_path / "a.gltf", tmp_path / "out.gltf"
    required = {"extensionsRequired": ["ACME_sky"], "extensionsUsed": ["ACME_sky"]}
    path.write_bytes(text({**animated(times=[0, 1]), **required}))
    name, *options = command.split()
    run = call(name, path, out, *options)
    assert run.code == 0, run.err
    assert "requires ACME_sky, not supported here" in run.err
    assert json.loads(out.read_text())["extensionsRequired"] == ["ACME_sky"]
    assert "ACME_sky" not in call(name, path, out, *options, "--quiet").err


def test_a_size_beyond_all_files_is_no_limit(walk: Path, call: Call, tmp_path: Path) -> None:
    call("optimize", walk, tmp_path / "out.glb", "--effort", "fast", "--max-bytes", "1e300GB").product()
