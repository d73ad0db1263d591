"""What Blender makes of files that we write: its vertices against our own cache, frame by frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from anim.arrays import AnyArray, Floats
from anim.caches.formats import flipbook_reader, gltf
from anim.caches.transforms import statistics
from anim.caches.transforms.vertex_order import reorder
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.model import Clip, VertexCache
from anim.sampling import frame_times
from anim.skinning.bake import bake, prepare_bake
from tests.blender import needs_blender, play, vertices
from tests.cli.conftest import Call, Find
from tests.cli.running import stated_length
from tests.files import glb_of, opened, opened_path
from tests.textured import textured, without_losses

pytestmark = [pytest.mark.slow, needs_blender]

BOUND = 1e-5  # of the diagonal
BAKES = [("Knight.glb", "Walking_A", ()), ("Knight.glb", "Cheer", ("--rigid",)), ("Fox.glb", "Survey", ())]
TEXTURED = [
    ("Fox.glb", "Survey"),
    ("CesiumMan.glb", "#0"),
    ("Knight.glb", "Cheer"),
    ("BitmojiRun.glb", "lbr_run_normal_anm_default"),
    ("", "bend"),  # two materials, KHR_texture_transform, and an unknown extension
]
NUM_IMAGES = {"Fox.glb": 1, "CesiumMan.glb": 1, "Knight.glb": 1, "BitmojiRun.glb": 1, "": 2}  # of base colors
EXPORTS = [("bake", "glb"), ("bake", "usdz"), ("bake", "abc"), ("convert", "usdz"), ("convert", "usdc")]
BACKGROUND = 0.95  # of white, less noise
MAX_DIFFERENCE, MIN_DIFFERENCE = 0.05, 0.1  # of pictures, 0 … 1
WRITERS = {
    "convert": (),
    "resample": ("--fps", "25"),
    "optimize": ("--max-error", "0.001%", "--effort", "fast"),
}


@pytest.mark.parametrize(("name", "clip", "options"), BAKES)
def test_morph_targets_are_the_bake(
    call: Call, asset: Find, tmp_path: Path, name: str, clip: str, options: tuple[str, ...]
) -> None:
    """At a small --max-error Blender shows the skinned vertices themselves, and the rigid ones on their nodes."""
    source, out = asset(name), tmp_path / "out.glb"
    run = call("bake", source, out, "--clip", clip, "--fps", 48, "--max-error", "0.0005%", *options)
    assert run.code == 0, run.err
    document = opened_path(source)
    (chosen,) = (each for each in reader.clips(document) if each.name == clip)
    times = frame_times(chosen.start, chosen.end, fps=48)
    truth = bake(reader.scene(document), chosen, times=times, rigid=True)
    assert _error(out, reorder(truth, "blender"), document) < BOUND


@pytest.mark.parametrize(("name", "clip", "options"), BAKES)
@pytest.mark.parametrize("more", [(), ("--quantize",)], ids=["float", "integers"])
def test_morph_targets_play_as_we_play_them(
    call: Call, asset: Find, tmp_path: Path, name: str, clip: str, options: tuple[str, ...], more: tuple[str, ...]
) -> None:
    out = tmp_path / "out.glb"
    assert call("bake", asset(name), out, "--clip", clip, "--fps", 24, *options, *more).code == 0
    document = opened_path(out)
    assert _error(out, reorder(gltf.evaluate_document(document), "blender"), document) < BOUND


def test_a_flip_book(call: Call, asset: Find, tmp_path: Path) -> None:
    """All pages but one are scaled to a point at the origin, so their sum is that one."""
    out = tmp_path / "out.glb"
    assert call("bake", asset("Fox.glb"), out, "--clip", "Walk", "--fps", 24, "--layout", "flip-scale").code == 0
    frames = flipbook_reader.read_pages(opened_path(out))
    assert frames is not None
    ours = reorder(frames, "blender")
    pages = vertices(out, (ours.times + 1e-3).tolist())  # not at the very instant of turning over
    assert len(pages) == ours.frame_count
    assert _apart(sum(pages.values(), np.zeros(())), ours.load_all().positions) < BOUND * statistics.diagonal(ours)


def test_a_point_cache_made_into_morph_targets(call: Call, asset: Find, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    assert call("bake", asset("Fox.glb"), tmp_path / "fox.npz", "--clip", "Walk", "--fps", 30).code == 0
    assert call("convert-cache", tmp_path / "fox.npz", out, "--max-error", "0.0005%").code == 0
    with np.load(tmp_path / "fox.npz") as found:
        frames, times, used = found["positions"], found["times"], np.unique(found["faces"])
    (seen,) = vertices(out, times).values()
    assert np.linalg.norm(seen - frames[:, used], axis=-1).max() < BOUND * _diagonal(frames)


@pytest.mark.parametrize("command", WRITERS)
@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb"])
def test_skinned_files(call: Call, asset: Find, tmp_path: Path, name: str, command: str) -> None:
    """Blender moves the rest pose into its bones, and mixes rotations by components: neither is seen at keys."""
    out = tmp_path / "out.glb"
    assert call(command, asset(name), out, *WRITERS[command]).code == 0
    document = opened_path(out)
    clip = reader.clips(document)[0]
    assert _error(out, _at_keys(document, clip), document, clip.name or None) < BOUND


@pytest.mark.parametrize(("name", "clip"), TEXTURED)
def test_textures_are_on(call: Call, asset: Find, tmp_path: Path, name: str, clip: str) -> None:
    """Blender has vertices within the stated error, texture coordinates, and pictures like that of the source."""
    source, unit = tmp_path / "source.glb", tmp_path / "out"
    document = without_losses(opened_path(asset(name)) if name else opened(textured()))
    source.write_bytes(glb_of(document))
    played = next(each for each in reader.clips(document) if clip in ("#0", each.name))
    times = frame_times(played.start, played.end, fps=24)
    truth = bake(reader.scene(document), played, times=times[::7], rigid=True)
    rest = prepare_bake(reader.scene(document), rigid=True).rest
    shown: dict[str, Any] = {
        "time": float(times[len(times) // 2]),
        "center": ((rest.min(axis=0) + rest.max(axis=0)) / 2).tolist(),
        "size": float(np.linalg.norm(np.ptp(rest, axis=0))),
    }

    def blender(path: Path, own: str | None = None) -> tuple[dict[str, Floats], dict[str, Any], Floats]:
        picture = {**shown, "file": f"{path}.png"}
        return *play(path, times[::7].tolist(), clip=own, fps=24, picture=picture), pixels(f"{path}.png")

    posed = blender(source, played.name or None)[2]
    for command, ending in EXPORTS:
        out = unit.with_name(f"{command}.{ending}")
        run = call(command, source, out, "--clip", clip, "--fps", 24, *(("--rigid",) if command == "bake" else ()))
        assert run.code == 0, run.err
        seen, looks, picture = blender(out)
        if ending != "abc":  # which has no materials
            assert difference(picture, posed) < MAX_DIFFERENCE
            assert sum(len(each["images"]) for each in looks.values()) >= NUM_IMAGES[name]
        else:
            assert difference(picture, posed) > MIN_DIFFERENCE
        textures = [each["coordinates"] for each in looks.values()]
        assert max(map(len, textures)) == (2 if name == "" and ending != "abc" else 1)
        expected = reorder(truth, "blender") if ending == "glb" else truth
        limit = stated_length(run.err) if "max " in run.err else 0.0
        frames = _with_faces(expected) if command == "convert" else expected.load_all().positions
        assert _farthest(seen, frames) <= limit + BOUND * statistics.diagonal(truth)


def pixels(path: str) -> Floats:
    """Colors (P, P, 3) of a picture, 0 … 1."""
    from PIL import Image

    return np.array(Image.open(path).convert("RGB"), np.float64) / 255


def difference(a: Floats, b: Floats) -> float:
    """Mean difference of two pictures, where one of them has something."""
    return float(np.abs(a - b)[np.minimum(a, b).min(axis=-1) < BACKGROUND].mean())


def _with_faces(cache: VertexCache) -> AnyArray:
    """The vertices of parts with faces."""
    used = [np.arange(*part.vertices) for part in cache.parts if part.faces[0] < part.faces[1]]
    return cache.load_all().positions[:, np.concatenate(used)]


def _farthest(seen: dict[str, Floats], frames: AnyArray) -> float:
    """Farthest vertex from any of the frames' vertices, in any order of objects."""
    found = np.concatenate(list(seen.values()), axis=1)
    assert found.shape == frames.shape
    return max(float(cKDTree(frame).query(rows)[0].max()) for frame, rows in zip(frames, found, strict=True))


def _at_keys(document: Document, clip: Clip) -> VertexCache:
    times = clip.key_times
    return reorder(bake(reader.scene(document), clip, times=times, rigid=True), "blender")


def _error(path: Path, ours: VertexCache, document: Document, clip: str | None = None) -> float:
    """Farthest vertex in Blender from ours, as a fraction of the diagonal; objects have the names of their nodes."""
    seen = vertices(path, ours.times.tolist(), clip=clip)
    frames = ours.load_all().positions
    spans: dict[str, list[int]] = {}
    for part in ours.parts:
        spans.setdefault(document.json["nodes"][part.node]["name"], []).extend(part.vertices)
    if len(seen) == 1:
        spans = {name: [0, ours.vertex_count] for name in seen}
    assert spans.keys() == seen.keys()
    errors = [_apart(seen[name], frames[:, min(ends) : max(ends)]) for name, ends in spans.items()]
    return max(errors) / statistics.diagonal(ours)


def _apart(a: Floats, b: AnyArray) -> float:
    assert a.shape == b.shape
    return float(np.linalg.norm(a - b, axis=-1).max())


def _diagonal(frames: AnyArray) -> float:
    points = frames.reshape(-1, 3)
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
