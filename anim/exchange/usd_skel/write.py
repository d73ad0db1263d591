"""Document → skinned USD (.usdc, .usda, .usdz) with UsdSkel, through usd-core (extra `usd`).

The skeleton, its skins and blend shapes stay, and one clip is sampled at a frame rate; other programs and phones play
it. Unskinned meshes below joints are bound to the skeleton; others are animated by the transforms of their nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from anim.caches.formats.usd_losses import node_loss_notes
from anim.caches.formats.usd_stage import SaveImage, package, write_stage
from anim.caches.storage import Outputs
from anim.errors import NotFoundError
from anim.exchange.usd_skel.measured_error import StageError, stage_error
from anim.exchange.usd_skel.sample_times import frame_rate, sample_times
from anim.exchange.usd_skel.stage import StageBuilder, StageTimes
from anim.files.signals import hold_signals
from anim.gltf.document import Document
from anim.memory import MemoryBudget
from anim.model import Clip, Scene
from anim.sampling.times import check_duration, check_fps
from anim.sampling.weight_pointers import resolve_weight_pointers

USD_FORMATS = (".usdz", ".usdc", ".usda")
BYTES_PER_POSE = 400  # of one node: sampled, written and read back
DEFAULT_FPS = 60.0  # of clips whose keys are on the frames of no common rate


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
    package()
    if fps is not None:
        fps = check_fps(fps)
    if not any(len(each.mesh.faces) for each in scene.instances):
        raise NotFoundError("there is no mesh with faces to write", help="USD has no use for a file without meshes")
    own_rate = frame_rate(clip) if fps is None else fps
    rate = own_rate or DEFAULT_FPS
    frames = check_duration(clip.start, clip.end, fps=rate)
    MemoryBudget(clip.num_bytes).check(round(BYTES_PER_POSE * len(scene.skeleton) * frames))
    times = StageTimes(sample_times(clip, rate, with_keys=own_rate is None), rate)
    notes = dict.fromkeys(_left_out(document, scene, clip))

    def build(stage: Any, save_image: SaveImage) -> tuple[StageError, dict[int, str]]:
        with hold_signals():  # the builder's poses of all frames are not kept while the error is measured
            prims = StageBuilder(stage, document, scene, clip, times).build(
                save_image, lambda words: notes.update({words: None})
            )
        error = stage_error(stage, prims, scene, clip, times.seconds, times.codes)
        return error, {node: str(prim.GetPath()) for node, prim in prims.items()}

    error, paths = write_stage(outputs, ending, "scene.usdc", build)
    return UsdSkelResult(rate, len(times.seconds), error, tuple(notes), paths)


def _left_out(document: Document, scene: Scene, clip: Clip) -> list[str]:
    """Notes on what is not written."""
    found = node_loss_notes(document.json)
    if any(track.path == "pointer" for track in resolve_weight_pointers(scene.skeleton, clip).tracks):
        found.append("channels of KHR_animation_pointer are left out")
    if any(len(each.mesh.positions) and not len(each.mesh.faces) for each in scene.instances):
        found.append("meshes of points and lines are left out")
    return found
