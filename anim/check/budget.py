"""Budgets: limits on sizes and counts of a file, and on its error against a source."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from anim.check.checked_file import CheckedFile
from anim.gltf.document import json_array

ERROR = "error"  # in m, against a source


def _keys_per_second(file: CheckedFile) -> float:
    """Keys of all tracks of a clip per second, of the clip with most."""
    return max((clip.keys / clip.duration_s for clip in file.facts.clips if clip.duration_s > 0), default=0.0)


def _targets(file: CheckedFile) -> float:
    primitives = (each for mesh in json_array(file.json, "meshes") for each in mesh["primitives"])
    return max((len(each.get("targets", ())) for each in primitives), default=0)


MEASURES: Mapping[str, Callable[[CheckedFile], float]] = MappingProxyType(
    {
        "bytes": lambda file: file.contents.file_bytes,
        "animation_bytes": lambda file: file.facts.animation_stored_bytes + file.facts.animation_json_bytes,
        "keys": lambda file: sum(clip.keys for clip in file.facts.clips),
        "keys_per_second": _keys_per_second,
        "seconds": lambda file: sum(clip.duration_s for clip in file.facts.clips),
        "clips": lambda file: len(file.facts.clips),
        "joints": lambda file: max((skin.joints for skin in file.facts.skins), default=0),
        "targets": _targets,
    }
)


def measure_budget(file: CheckedFile) -> Iterator[tuple[str, float, float]]:
    """Yield name, value and limit of each entry of the file's budget. joints, targets: of the largest skin or mesh."""
    for name, limit in file.budget.items():
        if name == ERROR:
            if file.source is not None:
                yield name, error_against(file.source, file), limit
        else:
            yield name, float(MEASURES[name](file)), limit


def error_against(source: CheckedFile, file: CheckedFile) -> float:
    """Return the largest distance of a vertex from the source's motion in m; infinite if a clip is missing.

    Clips are matched by name, else by order, as by `diff`.
    """
    from anim.measure.compare.equal_scenes import store_alike  # imports most of `measure`
    from anim.measure.compare.name_matching import match_by_name_then_order
    from anim.measure.continuous_bound.largest_error import largest_error
    from anim.measure.continuous_bound.prover import Prover
    from anim.measure.error.metric import ErrorMetric

    old, new = list(source.contents.clips.values()), list(file.contents.clips.values())
    partners = match_by_name_then_order([clip.name for clip in old], [clip.name for clip in new])
    if (partners < 0).any():
        return float("inf")
    prover = Prover(ErrorMetric(*store_alike(source.scene, file.scene)))
    errors = (largest_error(prover, clip, new[partners[i]]).error.max_error for i, clip in enumerate(old))
    return float(max(errors, default=0.0))
