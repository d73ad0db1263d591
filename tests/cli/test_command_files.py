"""No output of a command replaces another one, what is written beside it, or a file that the command reads."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built
from tests.textured import textured

PNG = b"\x89PNG\r\n\x1a\n" + bytes(20)


@pytest.fixture
def files(tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with models as one and as several files, a cache, options, and links to the buffer."""
    monkeypatch.chdir(tmp_path)
    Path("a.glb").write_bytes(built("arm"))
    call("convert", "a.glb", "a.gltf").product()
    text = json.loads(Path("a.gltf").read_text())
    Path("a.gltf").write_text(json.dumps({**text, "images": [{"uri": "skin.png"}]}))
    Path("skin.png").write_bytes(PNG)
    Path("t.glb").write_bytes(textured())
    Path("c.json").write_text(
        json.dumps({"schema": "spring-bones/1", "colliders": [{"node": "upper", "sphere": {"radius": 0.1}}]})
    )
    Path("s.toml").write_text("[check]\n")
    Path("gltf-anim.toml").write_text("[check]\n")
    for ending in ("glb", "json", "csv", "html", "png", "npz", "bvh", "svg"):
        Path(f"l.{ending}").symlink_to("a.bin")
    return tmp_path


FPS = "--clip bend --fps 2"


@pytest.mark.parametrize(
    "line",
    [
        # a dependency file, and what is beside OUT
        "resample a.glb out.GLTF --fps 10 --depfile out.bin",
        "resample a.glb out.gltf --fps 10 --depfile out.bin",
        "bake t.glb x.obj --clip #0 --fps 2 --depfile x.obj-image0.png",
        "bake t.glb x.obj --clip #0 --fps 2 --depfile x.obj.mtl",
        f"bake a.gltf x.ply {FPS} --depfile x_00001.ply",
        f"bake a.glb x.pc2 {FPS} --depfile x.pc2-rest.ply",
        f"bake a.glb x.png {FPS} --depfile x.png.json",
        f"bake a.glb x.png {FPS} --depfile x.png-mesh.glb",
        f"bake a.glb x.gltf {FPS} --depfile x.bin",
        "convert a.gltf sub/b.glb --depfile sub/skin.png",
        "convert a.gltf b.glb --depfile a.bin",
        "convert a.gltf b.glb --depfile skin.png",
        # another output
        "simulate cloth a.glb w.png --clip bend --duration 0.1 --report w.png.json",
        "optimize a.glb o.glb --report r.html --html r.html",
        "optimize a.glb o.glb --report o.html --html sub/../o.html",
        "diff a.glb a.gltf --plot d.svg --html d.svg",
        # files that are read
        "simulate particles a.glb o.glb --clip bend --node upper --colliders c.json --report c.json",
        "check a.gltf --write-baseline a.bin",
        "check a.gltf --write-baseline skin.png",
        "check . --write-baseline a.gltf",
        "check a.glb --config s.toml --write-baseline s.toml",
        "check a.glb --write-baseline gltf-anim.toml",
        # through a link to the buffer of the input
        "optimize a.gltf o.glb --report l.json",
        "optimize a.gltf o.glb --html l.html",
        "optimize a.gltf --curve l.csv",
        "collapse a.gltf --plot l.png",
        "resample a.gltf l.glb --fps 10",
        "loop a.gltf l.glb --clip bend --blend 0.1",
        "view a.gltf --out l.html",
        "sample a.gltf l.csv --fps 2",
        "sample a.gltf l.npz --fps 2 --clip bend",
        "to-euler a.gltf l.bvh --clip bend",
        "plot a.gltf l.png --clip bend",
        "render a.gltf l.png --clip bend --frames 1",
        f"bake a.gltf l.npz {FPS}",
        "convert a.gltf l.glb --dry-run",
    ],
)
def test_it_is_refused_before_a_file_changes(line: str, files: Path, call: Call) -> None:
    (files / "sub").mkdir()
    before = contents_below(files)
    run = call(*shlex.split(line))
    assert (run.code, run.out) == (2, b""), run.err
    said = run.err.splitlines()[-1] if "help:" not in run.err else run.err.splitlines()[-2]
    assert any(words in said for words in ("would replace", "be replaced by", "two outputs"))
    assert contents_below(files) == before
    assert all(path.is_symlink() for path in files.glob("l.*"))


def contents_below(folder: Path) -> dict[str, bytes]:
    return {str(each): each.read_bytes() for each in sorted(folder.rglob("*")) if each.is_file()}


@pytest.mark.parametrize(
    "line",
    [
        "resample a.gltf a.gltf --fps 10 --depfile a.d",
        f"bake a.gltf a.gltf {FPS}",
        f"bake a.gltf a.glb {FPS} --depfile /dev/null",
        "check a.glb --write-baseline known.json",
        "optimize a.glb o.glb --report /dev/null",
    ],
)
def test_what_is_no_fault_stays_allowed(line: str, files: Path, call: Call) -> None:
    """Also again."""
    for _ in range(2):
        call(*shlex.split(line)).product()


def test_caches_are_replaced_with_their_companions(files: Path, call: Call) -> None:
    for name in ("x.png", "x.pc2", "x.ply"):
        call("bake", "a.glb", name, *FPS.split()).product()
        call("convert-cache", name, name, "--up", "z").product()


def test_a_name_of_a_clip_is_no_file(files: Path, call: Call) -> None:
    """Any value of an option counted as a file that is read."""
    call("optimize", "a.glb", "out.glb", "--clip", "bend", "--report", "bend").product()
    assert Path("bend").is_file()


@pytest.mark.parametrize("line", ["resample a.gltf out/b.glb --fps 9", "convert a.gltf out/b.gltf"])
def test_no_image_is_copied_if_an_output_is_refused(line: str, files: Path, call: Call) -> None:
    Path("out").mkdir()
    assert call(*line.split(), "--depfile", "out/skin.png").code == 2
    assert not list(Path("out").iterdir())
    assert call(*line.split(), "--depfile", "out/skin.png", "--dry-run").code == 2
