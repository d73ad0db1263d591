"""Retargeting of a converted motion to a character: clip name, joint pairs, limit on unmatched joints."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

from anim.errors import NotFoundError
from anim.exchange.retarget import joint_matching
from anim.exchange.retarget.apply import apply_to_character, matchable_nodes
from anim.exchange.retarget.joint_roles import read_vrm_roles
from anim.exchange.retarget.retained_tracks import add_retained_tracks, retained_tracks, scaled_ancestors
from anim.exchange.retarget.retarget import GroundMode
from anim.files import resolver
from anim.gltf import authoring
from anim.gltf.document import Document
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Scene
from anim.operations.selection import Selection
from anim.units import list_some, plural
from cli import tables
from cli.errors import CheckError, UsageError
from cli.io import documents, scenes
from cli.reports import from_euler_report
from cli.reports.from_euler_report import ConversionReport
from cli.text import Reporter


@dataclass(frozen=True, slots=True)
class CharacterOptions:
    """Options of --onto: pairs of names, hip heights, time of the rest pose, limit on unmatched joints.

    replaced: index of the clip that the new one replaces; None to add it.
    """

    names: dict[str, str]
    floor: GroundMode
    bind_time: float | None
    fail_unmatched: int | None
    replaced: int | None = None


def put_on_character(
    made: ConversionReport, character: Source, casting: CharacterOptions, reporter: Reporter
) -> tuple[ConversionReport, Document]:
    """Return the conversion with its retargeting report, and the character's document with the clip.

    Raises CheckError if more joints than the limit are unmatched.
    """
    document = character.document
    scene = scenes.read_scene(document, character.name, reporter)
    try:
        done = apply_to_character(
            made.converted,
            scene,
            aliases=casting.names,
            nested=made.motion.nested,
            stated=read_vrm_roles(document.json),
            floor=casting.floor,
            bind_time=casting.bind_time,
        )
    except NotFoundError:  # no joint is matched, or an alias names an unknown joint
        _list_joints(made, scene, reporter)
        raise
    left = [made.converted.skeleton.names[node] for node in done.matching.unmatched]
    if casting.fail_unmatched is not None and len(left) > casting.fail_unmatched:
        raise CheckError(
            f"{len(left)} joints could not be matched (limit {casting.fail_unmatched}): "
            f"{from_euler_report.listed(left)}",
            help="pair joints in an --alias file; an empty target skips a joint",
        )
    made = replace(made, onto=done, character=scene.skeleton)
    if casting.replaced is not None:
        old = reader.clips(document)[casting.replaced]
        called = reader.quote_clip(old.name, casting.replaced)
        stay, num_gone = retained_tracks(old, done)
        if stay:
            reporter.info(f"note: {plural(len(stay), 'track')} of {called} that the motion has no node for stay")
        if num_gone:
            what = f"{plural(num_gone, 'track')} of {called} that the motion has no node for"
            reporter.warn(f"{what} go with it: it is another figure's motion")
        scaled = scaled_ancestors(done, stay, scene.skeleton)
        if scaled:
            names = ", ".join(scene.skeleton.label(node) for node in scaled)
            reporter.warn(f"the motion lacks the scale of {names} in {called}: joints below get their rest size")
        clip = add_retained_tracks(done, stay, scene.skeleton)
        return made, writer.replace_clips(document, {casting.replaced: clip})
    return made, authoring.add_clips(document, [done.clip])


def _list_joints(made: ConversionReport, scene: Scene, reporter: Reporter) -> None:
    """Report the names that can be paired, if details are requested."""
    moving, moved = matchable_nodes(made.converted, scene, nested=made.motion.nested)
    for what, skeleton, nodes in (
        ("motion", made.converted.skeleton, moving),
        ("character", scene.skeleton, moved),
    ):
        names = ", ".join(f"'{skeleton.names[node]}'" for node in sorted(nodes))
        reporter.verbose_info(f"joints of the {what} ({len(nodes)}): {tables.escape_control(names)}")


def pairs(path: str | None) -> dict[str, str]:
    """Return the pairs of an alias file, empty for None."""
    if path is None:
        return {}
    with documents.content(path, ending=".csv", read=resolver.read_options) as (data, _):
        return joint_matching.read_aliases(data.tobytes())


def named(made: ConversionReport, document: Document, *, name: str | None, replaced: int | None) -> ConversionReport:
    """Return the conversion with its clip's name and index in the character's file, and a note on a duplicate.

    name: as requested, used unchanged; None for the motion's own, with a numeric suffix if a clip has it. replaced:
    index of the clip whose position and name it takes.
    """
    names = reader.names(document)
    made = replace(made, clip_index=len(names) if replaced is None else replaced)
    if replaced is not None:
        return _called(made, names[replaced])
    own = made.converted.clip.name
    if own not in names:
        return made
    if name is not None:
        index = names.index(own)
        note = f"a second clip '{own}': #{len(names)} beside #{index}, which players and diff find first"
        return _called(made, own, f"{note} (--replace '#{index}' takes its place)")
    new = next(f"{own} {number}" for number in itertools.count(2) if f"{own} {number}" not in names)
    note = f"the character has a clip '{own}': this one is called '{new}'"
    return _called(made, new, f"{note} (--name says otherwise; --replace '{own}' takes its place)")


def index_of(replaced: str | None, document: Document) -> int | None:
    """Return the index of the clip with a name or '#index'. Raises NotFoundError for none or several."""
    if replaced is None:
        return None
    names = reader.names(document)
    found = Selection((replaced,)).chosen_clips(names)
    if len(found) > 1:
        listed = list_some([f"#{i} '{names[i]}'" if names[i] else f"#{i}" for i in found])
        raise NotFoundError(f"--replace '{replaced}' means {len(found)} clips (expected one)", help=f"one of {listed}")
    return found[0]


def check_name(name: str | None, replaced: int | None, document: Document) -> None:
    """Raise UsageError for a replaced clip together with another name."""
    if name is not None and replaced is not None and name != (own := reader.names(document)[replaced]):
        kept = f", '{own}'" if own else ": it has none"
        words = f"--replace keeps the name of the clip{kept} (got --name '{name}')"
        raise UsageError(words, help="leave --name out")


def _called(made: ConversionReport, name: str, *notes: str) -> ConversionReport:
    motion = replace(made.motion, notes=(*made.motion.notes, *notes))
    clip = replace(made.converted.clip, name=name)
    return replace(made, motion=motion, converted=replace(made.converted, clip=clip))
