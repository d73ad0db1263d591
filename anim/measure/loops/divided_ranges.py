"""Time ranges of many clips that each move few of many nodes: measured on the parts of the scene that they move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.skin_motion import SkinMotion
from anim.sampling.scene_parts import ScenePart

MIN_VALUES = 2000  # clips × nodes: fewer are measured as soon as parts are found
MAX_VALUES = 2000  # clips × nodes of a part: more take longer than the calls of numpy for another part

Result = TypeVar("Result")
Measure = Callable[[SkinMotion, Sequence[LoopRange]], list[Result]]


def measure_on_parts(skin: SkinMotion, ranges: Sequence[LoopRange], measure: Measure[Result]) -> list[Result]:
    """Return the results of ranges, each of a clip, as `measure` gives them for the whole scene."""
    if len(ranges) * len(skin.skeleton) < MIN_VALUES:
        return measure(skin, ranges)
    found: dict[int, Result] = {}
    for numbers, part in skin.divider.batches([each.clip for each in ranges], MAX_VALUES):
        some = ranges if len(numbers) == len(ranges) else [ranges[i] for i in numbers]
        placed = some if part is None else [_place(each, part) for each in some]
        found.update(zip(numbers, measure(skin if part is None else skin.part(part), placed), strict=True))
    return [found[i] for i in range(len(ranges))]


def _place(each: LoopRange, part: ScenePart) -> LoopRange:
    """The range of a clip of the part; a root that is not in it doesn't move."""
    root = int(np.searchsorted(part.nodes, each.root)) if each.root in part.nodes else -1
    return each._replace(clip=part.into(each.clip), root=root)
