"""A converted motion put on a character of the user's: names, partners, and the limit on those without one."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

from anim.exchange import aliases
from anim.exchange.onto import onto
from anim.exchange.retarget import Floor
from anim.gltf import author, read
from anim.gltf.document import Document, items
from cli import conversion, streams
from cli.conversion import Conversion
from cli.errors import CheckError


@dataclass(frozen=True, slots=True)
class Casting:
    """What --onto is told: pairs of names, what heights the hips get, the time of the rest pose, and the limit."""

    names: dict[str, str]
    floor: Floor
    rest_at: float | None
    fail_unmatched: int | None


def cast(made: Conversion, document: Document, casting: Casting) -> tuple[Conversion, Document]:
    """Return the conversion with what became of it on the character, and the document with the clip.

    Raises CheckError where more joints are without a partner than may be.
    """
    scene = read.scene(document)
    done = onto(
        made.converted,
        scene,
        aliases=casting.names,
        nested=made.motion.nested,
        floor=casting.floor,
        rest_at=casting.rest_at,
    )
    left = [made.converted.skeleton.names[node] for node in done.matching.unmatched]
    if casting.fail_unmatched is not None and len(left) > casting.fail_unmatched:
        raise CheckError(
            f"{len(left)} joints without a partner (limit {casting.fail_unmatched}): {conversion.listed(left)}",
            help="name partners in an --alias file; an empty target leaves a joint out",
        )
    return replace(made, onto=done, character=scene.skeleton), author.add_clips(document, [done.clip])


def pairs(path: str | None) -> dict[str, str]:
    """Return what an alias file says, nothing for none."""
    if path is None:
        return {}
    with streams.content(path, ending=".csv") as (data, _):
        return aliases.read(data.tobytes())


def renamed(made: Conversion, document: Document) -> Conversion:
    """Return the conversion with another name of its clip where the character has one so called."""
    taken = {clip.get("name") for clip in items(document.json, "animations")}
    name = made.converted.clip.name
    if name not in taken:
        return made
    new = next(f"{name} {number}" for number in itertools.count(2) if f"{name} {number}" not in taken)
    note = f"the character has a clip '{name}': this one is called '{new}' (--name says otherwise)"
    motion = replace(made.motion, notes=(*made.motion.notes, note))
    clip = replace(made.converted.clip, name=new)
    return replace(made, motion=motion, converted=replace(made.converted, clip=clip))
