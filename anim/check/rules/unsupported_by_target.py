"""GA503: parts of a file that the player of `--target` does not play as specified."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from anim.check.advice import clip_advice
from anim.check.budget import MEASURES
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.players import PLAYERS, Player
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array
from anim.model import Interpolation

LEAVE_OUT = "leave it out where the file is made"
TO_LINEAR = "gltf-anim resample IN OUT --fps {linear} --interpolation linear{clips}"
AS_LINEAR = f"to write LINEAR keys: {TO_LINEAR}"
AS_LINEAR_WITH_STEPS = f"to write LINEAR keys, and ramps of a frame for the STEP tracks: {TO_LINEAR}"


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence per part, for its first place; none without a target."""
    player = PLAYERS.get(parameters.target)
    if player is not None:
        yield from _interpolations(file, player)
        yield from _counts(file, player)
        for name in sorted(player.extensions & set(file.json.get("extensionsUsed", ()))):
            problem, advice = f"{name} is not supported", "write the file without it where it is made"
            yield Occurrence("extensionsUsed", "/extensionsUsed", problem=problem, advice=advice, name=name)


def _interpolations(file: CheckedFile, player: Player) -> Iterator[Occurrence]:
    for report, clip in file.clips:
        used = {track.interpolation for track in clip.tracks}
        if player.cubic and Interpolation.CUBICSPLINE in used:
            advice = AS_LINEAR_WITH_STEPS if Interpolation.STEP in used else AS_LINEAR
            found = file.in_clip(report.index, problem=player.cubic)
            yield replace(found, advice=clip_advice(advice, file.facts.clips, [report.index]))
        if player.step and Interpolation.STEP in used:
            yield file.in_clip(report.index, problem=player.step)
        if player.pointer and any(track.pointer is not None for track in clip.tracks):
            yield file.in_clip(report.index, problem=player.pointer)


def _counts(file: CheckedFile, player: Player) -> Iterator[Occurrence]:
    influences = max((skin.most_influences or 0 for skin in file.facts.skins), default=0)
    clips, skins = len(json_array(file.json, "animations")), len(file.facts.skins)
    limits = (
        ("/skins", f"up to {influences} influences per vertex", influences, player.influences),
        ("/skins", "joints in a skin", MEASURES["joints"](file), player.joints),
        ("/skins", "skins", skins, player.skins),
        ("/skins", "joints of a skin without a joint above", _most_roots(file), player.roots),
        ("/meshes", "morph targets of a mesh", MEASURES["targets"](file), player.morph_targets),
        ("/animations", "clips", clips, player.clips),
    )
    for pointer, words, count, most in limits:
        if most is not None and count > most:
            counted = words if words.startswith("up to") else f"{count:g} {words}"
            yield Occurrence(pointer[1:], pointer, value=count, problem=f"{counted}, of which the player uses {most}")


def _most_roots(file: CheckedFile) -> int:
    """Number of joints whose parent is no joint, of the skin with most."""
    joints = [set(skin["joints"]) for skin in json_array(file.json, "skins")]
    return max((sum(int(file.skeleton.parents[i]) not in each for i in each) for each in joints), default=0)


RULE = Rule(
    "GA503",
    "unsupported-by-target",
    Severity.WARNING,
    "The player of --target does not play a part of the file as glTF specifies it.",
    "From the sources of the players: glTFast writes CUBICSPLINE with wrong tangents, Scene Viewer plays the first "
    "clip only, Quick Look shows no morph targets.",
    find,
    advice=LEAVE_OUT,
    is_default=False,
    targets=dict.fromkeys(PLAYERS, Severity.WARNING),
)
