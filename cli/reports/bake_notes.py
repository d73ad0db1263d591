"""Notes and warnings of `bake` on data that is left out or lost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.model import Clip, MeshInstance, Scene
from anim.skinning.analysis.inbetween_error import InbetweenError
from anim.skinning.analysis.method_deviation import Deviation
from anim.skinning.bake import bakeable_instances
from anim.units import FEW, list_some, plural
from cli import text
from cli.text import Reporter

MIN_TIME_DIFFERENCE_S = 1e-3  # s; smaller differences are of rounding
VISIBLE_ERROR_PER_DIAGONAL = 1e-3  # of the diagonal; smaller errors are invisible


def lost_data_notes(found: Sequence[tuple[str, Deviation]], method: str, reporter: Reporter) -> None:
    """Warn of vertices farther from linear blending than the size of the model.

    found: name and deviation of each clip.
    """
    if far := [(each, name) for name, each in found if each.distance > each.size]:
        worst, name = max(far)
        reporter.warn(
            f"{method} can't be used: a vertex is {text.format_length(worst.distance)} from where linear blending "
            f"(lbs), and so every player, has it, more than the model's size of {text.format_length(worst.size)}, at "
            f"{text.format_instant(worst.time)} of {name}"
        )


def uneven_scale_note(joints: Sequence[int], scene: Scene, method: str, reporter: Reporter) -> None:
    """Note the joints with non-uniform scale if other tools define the method differently there."""
    if joints:
        names = list_some([f"'{scene.skeleton.display_name(node)}'" for node in joints], FEW)
        reporter.info(
            f"note: {names}: non-uniform scale, for which tools define {method} differently; here each joint "
            "scales the mesh about its origin before rotating it"
        )


def left_out_note(scene: Scene, nodes: Sequence[int] | None, reporter: Reporter) -> None:
    """Warn of the vertices left out because only nodes move them."""
    kept = set(bakeable_instances(scene, nodes=nodes))
    lost = [each for each in bakeable_instances(scene, rigid=True, nodes=nodes) if each not in kept]
    if lost:
        count = sum(len(each.mesh.positions) for each in lost)
        reporter.warn(_skipped_words(count))


def only_baked_words(left_out: Sequence[MeshInstance], baked: str) -> str:
    """Return a sentence for the page of a bake, with the warning of `bake` on the meshes that are not in it."""
    count = sum(len(each.mesh.positions) for each in left_out)
    rigid = sum(len(each.mesh.positions) for each in left_out if each.skin is None and not len(each.mesh.targets))
    parts = [_skipped_words(rigid)] if rigid else []
    parts += [f"skipped {plural(count - rigid, 'vertex', 'vertices')} of other meshes"] if count > rigid else []
    return f"Only the meshes in {baked} are shown: {', '.join(parts)}"


def _skipped_words(count: int) -> str:
    return f"skipped {plural(count, 'vertex', 'vertices')} of unskinned meshes (include with --rigid)"


def clamped_range_note(
    clips: Sequence[tuple[str, Clip]], start: float | None, end: float | None, reporter: Reporter
) -> None:
    """Note the clips, by their labels, that begin after the start of a range or end before its end."""
    if start is not None:
        late = [(name, each.start) for name, each in clips if each.start - start > MIN_TIME_DIFFERENCE_S]
        _note_range("--from", start, "begins", late, reporter)
    if end is not None:
        early = [(name, each.end) for name, each in clips if end - each.end > MIN_TIME_DIFFERENCE_S]
        _note_range("--to", end, "ends", early, reporter)


def _note_range(option: str, given: float, verb: str, found: Sequence[tuple[str, float]], reporter: Reporter) -> None:
    if found:
        name, time = found[0]
        others = f", and {len(found) - 1} more" if len(found) > 1 else ""
        reporter.info(
            f"note: {option} is {text.format_instant(given)}, but {name} {verb} at {text.format_instant(time)}{others}"
        )


def frame_gap_note(
    found: Sequence[tuple[str, InbetweenError]], rest: Floats, reporter: Reporter, *, is_chosen: bool = False
) -> None:
    """Warn of the error of linear interpolation between frames, for the clip with the most visible one.

    found: name and inter-frame error of each clip. rest: (V, 3) m, for the diagonal. is_chosen: whether the user chose
    the frame rate; then it is only a note.
    """
    diagonal = float(np.linalg.norm(np.ptp(rest, axis=0))) if len(rest) else 0.0
    seen = [(missed, name) for name, missed in found if missed.distance > VISIBLE_ERROR_PER_DIAGONAL * diagonal]
    if seen:
        missed, name = max(seen)
        others = f" ({len(seen)} clips are affected)" if len(seen) > 1 else ""
        words = (
            f"linear interpolation between frames: error of {text.format_length(missed.distance)}"
            f"{text.format_fraction(missed.distance, diagonal)} or more at {text.format_instant(missed.time)} of "
            f"{name}{others} (reduce with {'a higher ' if is_chosen else ''}--fps)"
        )
        if is_chosen:
            reporter.info(f"note: {words}")
        else:
            reporter.warn(words)
