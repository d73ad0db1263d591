"""Document → skinned USD (.usdc, .usda, .usdz) with UsdSkel, through usd-core (extra `usd`).

The skeleton, its skins and blend shapes stay, and one clip is sampled at a frame rate; other programs and phones play
it. Unskinned meshes below joints are bound to the skeleton; others are animated by the transforms of their nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.caches import temporary_files
from anim.caches.formats.usd_package import write_package
from anim.caches.formats.usd_writer import USUAL_FPS, package
from anim.caches.storage import Outputs, companion_name
from anim.errors import NotFoundError
from anim.exchange.usd_skel.measured_error import StageError, stage_error
from anim.exchange.usd_skel.stage import StageBuilder, StageTimes
from anim.gltf.document import Document
from anim.model import Clip, Interpolation, Scene
from anim.sampling.times import frame_times, jump_time_before

USD_FORMATS = (".usdz", ".usdc", ".usda")
DEFAULT_FPS = 60.0  # of clips whose keys are on the frames of no common rate
FRAME_TOLERANCE = 1e-3  # of a frame
MIN_INTERVAL_S = 5e-7  # s; half the shortest jump
MAX_KEY_INTERVAL_S = 0.05  # s; of clips with keys farther apart, the rate of the keys is none of frames


@dataclass(frozen=True, slots=True)
class UsdSkelResult:
    """Result of writing. fps: frames per second. frames: number of time samples. error: of the written stage.

    notes: lines for the user, on data that USD does not have. paths: of the Mesh prim of each instance, by node.
    """

    fps: float
    frames: int
    error: StageError
    notes: tuple[str, ...]
    paths: dict[int, str]


def write(
    document: Document, scene: Scene, clip: Clip, outputs: Outputs, *, ending: str, fps: float | None = None
) -> UsdSkelResult:
    """Write the meshes of a scene with one clip. document: with its images inside. ending: one of USD_FORMATS.

    scene: with normals. fps: None for the clip's `frame_rate`, or else 60 with samples at all keys too. Images lie
    beside a .usdc or .usda. Raises UnsupportedError without usd-core, or for a skin that USD can't express,
    NotFoundError without faces.
    """
    usd, _, _ = package()
    if not any(len(each.mesh.faces) for each in scene.instances):
        raise NotFoundError("there is no mesh with faces to write", help="USD has no use for a file without meshes")
    rate = fps or frame_rate(clip) or DEFAULT_FPS
    times = StageTimes(sample_times(clip, rate, with_keys=fps is None and frame_rate(clip) is None), rate)
    images, notes = list[tuple[str, bytes]](), dict.fromkeys(_left_out(document, scene, clip))

    def save_image(number: int, kind: str, data: bytes) -> str:
        own = f"image{number}{kind}"
        images.append((own if ending == ".usdz" else companion_name(outputs.main, f"-{own}"), data))
        return images[-1][0] if ending == ".usdz" else f"./{images[-1][0]}"

    with temporary_files.temp_output(outputs, outputs.main, ending) as path:
        binary = path if ending == ".usdc" else f"{path}.usdc"
        stage = usd.Stage.CreateNew(binary)
        builder = StageBuilder(stage, document, scene, clip, times)
        builder.build(save_image, lambda words: notes.update({words: None}))
        error = stage_error(stage, builder.prims, scene, clip, times.seconds, times.codes)
        paths = {node: str(prim.GetPath()) for node, prim in builder.prims.items()}
        stage.GetRootLayer().Save()
        if ending == ".usda":
            stage.GetRootLayer().Export(path)
        elif ending == ".usdz":
            del stage, builder
            write_package(path, binary, images, name="scene.usdc")
    for name, data in images if ending != ".usdz" else ():
        with outputs.create(name) as file:
            file.write(data)
    return UsdSkelResult(rate, len(times.seconds), error, tuple(notes), paths)


def frame_rate(clip: Clip) -> float | None:
    """Return the first common rate with all keys but the last of a clip on its frames; None for sparse keys or none."""
    keys = clip.key_times
    if len(keys) < 3 or np.diff(keys).max() > MAX_KEY_INTERVAL_S:
        return None
    for rate in USUAL_FPS:
        off = (keys[:-1] - keys[0]) * rate
        if np.abs(off - np.rint(off)).max() < FRAME_TOLERANCE:
            return float(rate)
    return None


def sample_times(clip: Clip, fps: float, *, with_keys: bool = False) -> Floats:
    """Return the times (F,) s of samples: frames at a rate, and both sides of the jumps of STEP tracks.

    with_keys: all keys too.
    """
    frames = frame_times(clip.start, clip.end, fps=fps)
    more = [frames, *([clip.key_times] if with_keys else ())]
    for track in clip.tracks:
        if track.interpolation is Interpolation.STEP:
            jumps = track.times[1:][(np.diff(track.values, axis=0) != 0).any(axis=1)]
            more += [jumps, jump_time_before(jumps)]
    found = np.unique(np.concatenate(more))
    return found[np.append(True, np.diff(found) > MIN_INTERVAL_S)] if len(more) > 1 else frames


def _left_out(document: Document, scene: Scene, clip: Clip) -> list[str]:
    """Notes on what is not written."""
    found = []
    if any("camera" in node for node in document.json.get("nodes", ())):
        found.append("cameras are left out")
    if any(track.path == "pointer" for track in clip.tracks):
        found.append("channels of KHR_animation_pointer are left out")
    if any(len(each.mesh.positions) and not len(each.mesh.faces) for each in scene.instances):
        found.append("meshes of points and lines are left out")
    return found
