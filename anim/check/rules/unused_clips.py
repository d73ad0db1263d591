"""GA005: clips that animate nothing of any scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.errors import UnsupportedError
from anim.gltf.document import Document, json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips; none of files without scenes, whose nodes are all shown."""
    scenes = json_array(file.json, "scenes")
    if not scenes:
        return
    shown = _reachable(file, [root for scene in scenes for root in scene.get("nodes", ())])
    shown |= _joints(file, shown)
    for report, clip in file.clips:
        targets = {track.node for track in clip.tracks}
        if targets and None not in targets and not targets & shown:
            yield file.in_clip(report.index)


def _reachable(file: CheckedFile, roots: list[int]) -> set[int | None]:
    nodes = json_array(file.json, "nodes")
    found: set[int | None] = set()
    stack = roots
    while stack:
        node = stack.pop()
        if node not in found:
            found.add(node)
            stack.extend(nodes[node].get("children", ()))
    return found


def _joints(file: CheckedFile, shown: set[int | None]) -> set[int | None]:
    """Return the joints of shown skins with their ancestors, which move vertices wherever they are."""
    skins = {file.json["nodes"][node].get("skin") for node in shown if node is not None} - {None}
    found: set[int | None] = set()
    for joint in (joint for skin in skins for joint in file.json["skins"][skin]["joints"]):
        while joint >= 0 and joint not in found:
            found.add(joint)
            joint = int(file.skeleton.parents[joint])
    return found


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without these clips, and without their bytes."""
    from anim.gltf.writing.removal import remove_animations  # only fixes write
    from anim.gltf.writing.unknown_extensions import extensions_naming_clips

    if named := extensions_naming_clips(file.json):
        raise UnsupportedError(f"{named[0]} may name clips by their index, which would change")
    return remove_animations(file.document, {each.number for each in found})


RULE = Rule(
    "GA005",
    "unused-clips",
    Severity.WARNING,
    "Clips animate nodes that are in no scene.",
    "Players skip them, or animate another node of the same name (mrdoob/three.js#22204).",
    find,
    counted("clip animates nothing of any scene", "clips animate nothing of any scene"),
    "add the nodes to a scene, or leave the clips out where the file is made",
    fix=Fix("remove them", fix, is_safe=False),
)
