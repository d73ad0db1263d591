"""GA304: feet that move over the ground while they are on it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule
from anim.gltf.document import json_array
from anim.measure.inspect.frame_rate import estimate_frame_rate
from anim.measure.inspect.inspect import useful_joints
from anim.model import Clip
from anim.sampling.pose import sample_pose
from anim.sampling.world import world_by_node

FEET = r"(?i)foot|toe|ankle|ball|paw|hoof"
MAX_HEIGHT_PER_SIZE = 0.012  # of the figure's height, above the foot's lowest position
MAX_RISE_PER_SIZE_S = 0.12  # of the figure's height per second, up or down
MIN_CONTACT_S = 0.1
MIN_CONTACT_FRAMES = 4
MIN_FPS, MAX_FPS, DEFAULT_FPS = 10.0, 60.0, 30.0


class Contact(NamedTuple):
    """A foot on the ground: node, times (F,) in s, positions on the ground (F, 2) in m, and median velocity (2,)."""

    node: int
    times: Floats
    positions: Floats
    velocity: Floats


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of contacts in which a foot slides.

    The median velocity of all contacts is that of the ground: of a treadmill in clips that stay in place.
    """
    joints = file.joints or _animated(file)
    feet = [joint for joint in _skinned(file) or joints if re.search(FEET, file.skeleton.names[joint])]
    for report, clip in file.clips if feet else ():
        height, contacts = _contacts(file, clip, joints, feet)
        if not contacts:
            continue
        ground = np.median([each.velocity for each in contacts], axis=0)
        slips = [np.ptp(each.positions - ground * each.times[:, None], axis=0) for each in contacts]
        lengths = [float(np.sqrt((slip**2).sum())) / height for slip in slips]
        if count := sum(length > parameters["slide"] for length in lengths):
            worst = contacts[int(np.argmax(lengths))]
            problem = (
                f"'{file.skeleton.names[worst.node]}' slides by {100 * max(lengths):.2g} % of the figure's height at "
                f"{worst.times[0]:.2f} s" + (f" (and in {count - 1} more contacts)" if count > 1 else "")
            )
            at = float(worst.times[0])
            yield file.in_clip(report.index, count, max(lengths), problem=problem, time_s=at, node=worst.node)


def _skinned(file: CheckedFile) -> list[int]:
    """The joints that move vertices, not those of controls; none in files without vertices."""
    nodes = json_array(file.json, "nodes")
    useful: set[int] = set()
    for i, skin in enumerate(json_array(file.json, "skins")):
        instances = [each for each in file.scene.instances if nodes[each.node].get("skin") == i]
        useful |= useful_joints(instances, skin["joints"], file.skeleton)
    return sorted(useful)


def _animated(file: CheckedFile) -> list[int]:
    """The animated nodes, which are the joints of a file without skins, as of captured motion."""
    return sorted({track.node for _, clip in file.clips for track in clip.tracks if track.node is not None})


def _contacts(file: CheckedFile, clip: Clip, joints: list[int], feet: list[int]) -> tuple[float, list[Contact]]:
    """Height of the figure, and the contacts of its feet with the ground."""
    guess = estimate_frame_rate(clip.key_times)
    fps = min(max(guess.fps if guess else DEFAULT_FPS, MIN_FPS), MAX_FPS)
    frames = max(round((clip.end - clip.start) * fps), 1)
    times = np.minimum(clip.start + np.arange(frames + 1) / fps, clip.end)
    if frames < MIN_CONTACT_FRAMES:
        return 1.0, []
    world = world_by_node(file.skeleton, sample_pose(file.skeleton, clip, times))[..., 3]
    height = float(world[joints][..., 1].max() - world[feet][..., 1].min()) or 1.0
    contacts = []
    for foot in feet:
        places = world[foot]
        speeds = np.gradient(places, 1 / fps, axis=0)
        low = places[:, 1] < places[:, 1].min() + MAX_HEIGHT_PER_SIZE * height
        on_ground = low & (np.abs(speeds[:, 1]) < MAX_RISE_PER_SIZE_S * height)
        for first, last in _runs(on_ground, max(MIN_CONTACT_FRAMES, MIN_CONTACT_S * fps)):
            part = slice(first, last)
            velocity = np.median(speeds[part, ::2], axis=0)
            contacts.append(Contact(foot, times[part], places[part, ::2], velocity))
    return height, contacts


def _runs(mask: Bools, least: float) -> Iterator[tuple[int, int]]:
    """Yield start and end of each run of True with at least some frames."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask, [0]))))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first >= least:
            yield int(first), int(last)


RULE = Rule(
    "GA304",
    "foot-slide",
    Severity.INFO,
    "A foot moves over the ground while it is on it.",
    "Feet that skate give away a wrong speed, or a motion on another figure. Dances and falls slide on purpose.",
    find,
    advice="look at the contact; correct the foot or the root where the clip is made",
    parameters={"slide": Parameter(0.05, "%", "shortest slide, of the figure's height")},
    is_default=False,
    is_costly=True,
)
