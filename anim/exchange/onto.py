"""A converted motion on a character: match joints by name, then retarget, or bind curves that are the nodes' own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from anim.errors import NotFoundError
from anim.exchange.from_euler import Converted
from anim.exchange.match import Matching, match
from anim.exchange.retarget import Floor, retarget
from anim.model import Clip, Scene


@dataclass(frozen=True, slots=True)
class Onto:
    """The clip for the character, and what became of the motion's joints.

    scale: of the path, character by motion. lowered: least and most that hips went down, metres.
    """

    clip: Clip
    matching: Matching
    scale: float
    lowered: tuple[float, float]


def onto(
    source: Converted,
    target: Scene,
    *,
    aliases: Mapping[str, str],
    nested: bool,
    floor: Floor = Floor.CONTACT,
    rest_at: float | None = None,
) -> Onto:
    """Return the motion as a clip of the character.

    Joints are those of the character's skins, or all its nodes where it has none. See `match` and `retarget`.
    nested: whether the motion has a hierarchy; if not, its curves are the nodes' own and go to them as they are.
    Raises NotFoundError where no joint is matched, or there is none.
    """
    joints = {int(node) for each in target.instances if each.skin is not None for node in each.skin.joints}
    matching = match(
        source.skeleton.names,
        target.skeleton.names,
        aliases=aliases,
        of_source=_parents_first(source),
        of_target=sorted(joints) if joints and nested else list(range(len(target.skeleton))),
    )
    if not target.skeleton.names:
        raise NotFoundError("the character has no nodes that a motion could move")
    if not matching.pairs:
        first = source.skeleton.names[0], target.skeleton.names[min(joints, default=0)]
        raise NotFoundError(
            "no joint of the motion is one of the character",
            help=f"pair them in an --alias file, in lines such as '{first[0]},{first[1]}'",
        )
    if nested:
        done = retarget(source, target, matching, floor=floor, rest_at=rest_at)
        return Onto(done.clip, matching, done.scale, done.lowered)
    tracks = [
        replace(track, node=matching.pairs[track.node])
        for track in source.clip.tracks
        if track.node is not None and track.node in matching.pairs
    ]
    return Onto(Clip(source.clip.name, tuple(tracks)), matching, 1.0, (0.0, 0.0))


def _parents_first(source: Converted) -> list[int]:
    return [int(n) for level in source.skeleton.levels() for n in level if int(n) not in source.ends]
