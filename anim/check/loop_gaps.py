"""Loop gaps of clips, for the rules on loops."""

from __future__ import annotations

from collections.abc import Sequence

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.divided_ranges import measure_on_parts
from anim.measure.loops.joint_gaps import JointGap, joint_gaps
from anim.units import format_number


def gaps_by_clip(file: CheckedFile, numbers: Sequence[int]) -> dict[int, list[JointGap]]:
    """Return the joints of clips with a gap, by index of the clip. The translation of a root that travels is none."""
    clips = [file.contents.clips[number] for number in numbers]
    ranges = [LoopRange(each, each.start, each.end, root=root_motion_node(file.skeleton, each)) for each in clips]
    return dict(zip(numbers, measure_on_parts(file.motion, ranges, joint_gaps), strict=True))


def describe_gap(found: Sequence[Occurrence]) -> str:
    """Return words for the largest gap; values are loop gaps as fractions of the model's size."""
    largest = max(each.value for each in found)
    return f"a loop jumps by {format_number(100 * largest, 2)} % of the model's size"
