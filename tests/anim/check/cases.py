"""A file for each rule that breaks it, and one that does not."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.check.checked_file import CheckedFile
from anim.check.find import find_all
from anim.check.finding import Finding
from anim.check.selection import RuleSelection
from anim.errors import AnimError
from anim.gltf.document import Buffer, Document
from anim.gltf.io import container
from anim.gltf.io.lenient import read_broken
from anim.gltf.writing import writer
from anim.gltf.writing.append import VERTICES, append_accessors
from anim.measure.inspect.contents import read_contents
from anim.measure.inspect.inspect import inspect
from anim.model import Clip, Track
from tests.anim.check.json_faults import (
    ARM_JOINTS,
    FOOT,
    Edit,
    apart,
    declared_pointer,
    equal_names,
    idle_joint,
    joints_apart,
    move_mesh,
    other_root,
    pointer_at_node,
    put,
    same_names,
    scale_above,
    second_skin,
    strided_matrices,
    unused_sampler,
    with_matrix,
    with_strides,
    without_bounds,
    without_joints,
    wrong_hint,
    wrong_type,
)
from tests.clips import CUBICSPLINE, about, track
from tests.files import glb_of, opened_fixture

FRAMES = np.arange(40)
SECOND = np.linspace(0, 1, 13)
SMOOTH = np.sin(SECOND * 2 * np.pi)[:, None] * [0.1, 0.0, 0.0]

WAVE_12 = track("translation", SECOND, SMOOTH, node=1)
OPEN_WAVE = track("translation", SECOND[:-1], SMOOTH[:-1], node=1)
WAVE_120 = track("translation", SECOND / 10, SMOOTH, node=1)


def checked(document: Document) -> CheckedFile:
    """Return a document as `check` sees it once it is written, also an invalid one."""
    data = np.frombuffer(glb_of(document), np.uint8)
    broken = None
    try:
        read = container.read(data)
    except AnimError as error:
        broken = read_broken(data, None, error)
        read = broken.document
    contents = read_contents(read, file_bytes=len(data), broken=broken)
    return CheckedFile(contents, inspect(contents))


def selection(code: str) -> RuleSelection:
    """Return the selection of one rule, with the parameters and the target with which its file breaks it."""
    values = {f"{code}.{name}": value for name, value in PARAMETERS.get(code, {}).items()}
    return RuleSelection(select=(code,), parameters=values, target=TARGETS.get(code, ""))


def found(document: Document, code: str, **parameters: str) -> list[Finding]:
    """Return the findings of one rule."""
    values = {f"{code}.{name}": value for name, value in parameters.items()}
    return [*find_all(checked(document), RuleSelection(select=(code,), parameters=values))]


def edited(edit: Edit, name: str = "arm") -> Document:
    """Return a fixture with an edited JSON."""
    document = opened_fixture(name)
    json = copy.deepcopy(document.json)
    edit(json)
    return Document(json, document.buffers)


def with_tracks(*tracks: Track, name: str = "walk", fixture: str = "arm") -> Document:
    """Return a fixture with other tracks in its first clip."""
    document = opened_fixture(fixture)
    return writer.replace_clips(document, {0: Clip(name, tracks)})


def steps(values: Sequence[float]) -> Track:
    return track("translation", np.arange(len(values)) / 10, [[value, 0, 0] for value in values], node=1)


def joint(path: str, values: list[list[float]], times: list[float] | None = None) -> Track:
    return track(path, np.array(times or [0.0, 1.0]), values, node=opened_fixture("arm").json["skins"][0]["joints"][1])


def with_weights(values: list[list[float]]) -> Document:
    return with_tracks(track("weights", np.array([0.0, 1.0]), values, node=0), fixture="morph_cube")


def spline(slope: float) -> Track:
    tangents = [[slope, 0, 0], [-slope, 0, 0]]
    return track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]], CUBICSPLINE, node=1, tangents=(tangents, tangents))


def swing(fault: Callable[[Floats], Floats] = lambda degrees: degrees) -> Track:
    """Return a joint that swings about X by 30°, with a planted fault."""
    return track("rotation", FRAMES / 30, about("x", fault(30 * np.sin(FRAMES / 6))), node=ARM_JOINTS[1])


def pop(degrees: Floats) -> Floats:
    return np.asarray(degrees + 12.0 * (FRAMES == 20))


def jump(degrees: Floats) -> Floats:
    return np.asarray(degrees * 0.05 + 60.0 * (FRAMES >= 20))


def tremble(degrees: Floats) -> Floats:
    return np.asarray(degrees * 0.02 + 1.5 * (-1.0) ** FRAMES * ((FRAMES > 10) & (FRAMES < 22)))


def rotation(*degrees: float, sign: float = 1.0) -> Track:
    """Return rotations of a joint about X, a second apart. sign: of the last key."""
    values = about("x", degrees)
    values[-1] *= sign
    return track("rotation", np.arange(len(degrees)), values, node=ARM_JOINTS[1])


def flipped_spline() -> Track:
    zero, values = np.zeros((2, 4)), about("x", [0, 20])
    values[1] *= -1
    return track("rotation", [0, 1], values, CUBICSPLINE, node=ARM_JOINTS[1], tangents=(zero, zero))


def with_hidden_positions(document: Document) -> Document:
    """Return a document with positions that only an extension nobody knows can give."""
    json = copy.deepcopy(document.json)
    position = json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    json["accessors"][position].update(bufferView=len(json["bufferViews"]), byteOffset=0)
    json["bufferViews"].append({"buffer": len(json["buffers"]), "byteLength": 9999, "extensions": {"ACME_packed": {}}})
    json["buffers"].append({"byteLength": 9999})
    return Document(json, (*document.buffers, Buffer(9999, None, None)))


def with_influences(joints: list[list[int]], weights: list[list[float]]) -> Document:
    """Return the arm with these joints and weights, sets of four, in every vertex."""
    document = edited(lambda json: None)
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    count = document.json["accessors"][attributes["POSITION"]]["count"]
    for k, (some, factors) in enumerate(zip(joints, weights, strict=True)):
        rows = [np.tile(np.array(some, "u1"), (count, 1)), np.tile(np.array(factors, "<f4"), (count, 1))]
        document, indices = append_accessors(document, [(each, VERTICES) for each in rows])
        attributes[f"JOINTS_{k}"], attributes[f"WEIGHTS_{k}"] = indices
    return document


def step_of(slide: float) -> Document:
    """Return the arm as a leg: its last joint is a foot, raised twice, and slides on the ground in one of two steps."""
    times = np.arange(61) / 30
    raised = np.clip(np.sin(times * 2 * np.pi), 0, None)
    way = np.where(times > 1.5, np.minimum(times - 1.5, 0.2), 0) * slide
    foot = opened_fixture("arm").json["nodes"][FOOT].get("translation", [0, 0, 0])
    values = np.array(foot) + np.stack((way, 0.5 * raised, 0 * raised), axis=1)
    document = with_tracks(track("translation", times, values, node=FOOT))
    document.json["nodes"][FOOT]["name"] = "LeftFoot"
    return document


def creeping(way: float) -> Track:
    """Return a root that moves by a fraction of the arm's size."""
    distance = way * checked(opened_fixture("arm")).diagonal
    return track("translation", np.arange(5) / 4, np.linspace(0, 1, 5)[:, None] * [distance, 0, 0], node=ARM_JOINTS[0])


def without_file(document: Document) -> CheckedFile:
    return replace(checked(document), missing=[("image 0", "/images/0/uri", "is not there")])


WRONG: dict[str, tuple[Document | CheckedFile, str]] = {
    "GA001": (edited(put("animations/0/name", "")), "/animations/0"),
    "GA002": (edited(equal_names), "/animations/"),
    "GA003": (edited(same_names, "biped"), "/nodes/"),
    "GA004": (edited(put("nodes/1/name", "arm.l")), "/nodes/1"),
    "GA005": (edited(other_root), "/animations/0"),
    "GA006": (edited(put("animations/0/name", "Walk 1")), "/animations/0"),
    "GA007": (edited(put("meshes/0/extras", None), "morph_cube"), "/meshes/0"),
    "GA010": (edited(put("animations/0/samplers/0/output", 999)), ""),
    "GA011": (edited(put("materials", [])), "/materials"),
    "GA012": (edited(put("accessors/0/normalized", True)), "/accessors/0"),
    "GA013": (edited(wrong_type), "/accessors/"),
    "GA014": (edited(unused_sampler), "/animations/0"),
    "GA015": (edited(put("animations/0/channels/0/target", {"path": "pointer"})), "/animations/0"),
    "GA016": (edited(without_bounds), "/accessors/"),
    "GA017": (edited(with_strides), "/accessors/"),
    "GA018": (edited(with_matrix), "/nodes/"),
    "GA019": (edited(put("extensionsRequired", ["ACME_sky"])), "/extensionsRequired"),
    "GA020": (with_hidden_positions(opened_fixture("arm")), "/meshes"),
    "GA021": (without_file(opened_fixture("arm")), "/images/0/uri"),
    "GA022": (edited(without_joints), "/meshes"),
    "GA101": (with_tracks(rotation(0, 175)), "/animations/0"),
    "GA102": (with_tracks(rotation(0, 100)), "/animations/"),
    "GA103": (with_tracks(rotation(0, 30, sign=-1)), "/animations/0"),
    "GA104": (opened_fixture("noop"), "/animations/"),
    "GA105": (with_tracks(joint("translation", [[0, 1, 0], [0, 2, 0]], [0.5, 1])), "/animations/0"),
    "GA106": (with_tracks(joint("translation", [[0, 0, 0]], [0])), "/animations/0"),
    "GA107": (with_tracks(steps([0, 0, 2, 0.02, 0.02])), "/animations/0"),
    "GA108": (with_tracks(OPEN_WAVE), "/animations/0"),
    "GA109": (with_tracks(track("translation", SECOND**1.7, SMOOTH, node=1)), "/animations/0"),
    "GA110": (with_tracks(WAVE_120), "/animations/0"),
    "GA111": (with_tracks(steps([0, 1, 2, 3, 4, 0])), "/animations/0"),
    "GA112": (with_tracks(steps([0, 1, 0]), joint("scale", [[2, 2, 2], [2, 2, 2]])), "/animations/0"),
    "GA113": (with_tracks(steps([0, 1, 0]), joint("scale", [[1, 1, 1], [1, 1, 1]])), "/animations/0"),
    "GA114": (with_tracks(steps([0] * 5 + [1] * 5 + [0] * 5)), "/animations/0"),
    "GA115": (with_tracks(spline(8.0)), "/animations/0"),
    "GA116": (with_tracks(joint("scale", [[1, 1, 1], [0, 1, 1]])), "/animations/0"),
    "GA117": (with_tracks(joint("scale", [[1, 1, 1], [-1, 1, 1]])), "/animations/0"),
    "GA118": (
        with_weights([[0, 1.5, 0], [1, 0, 0]]),
        "/animations/0",
    ),
    "GA119": (with_weights([[0, 1, 0], [1, 0, 0]]), "/animations/"),
    "GA120": (with_tracks(flipped_spline()), "/animations/0"),
    "GA201": (with_influences([[0, 1, 0, 1], [1, 0, 0, 0]], [[0.3, 0.2, 0.2, 0.2], [0.1, 0, 0, 0]]), "/skins/0"),
    "GA202": (with_influences([[0, 1, 0, 0]], [[0.4, 0.4, 0, 0]]), "/skins/0"),
    "GA203": (opened_fixture("arm"), "/skins/0"),
    "GA204": (edited(second_skin), "/nodes/"),
    "GA205": (edited(put("skins/0/inverseBindMatrices", None)), "/skins/0"),
    "GA206": (edited(apart), "/skins/0"),
    "GA207": (edited(move_mesh), "/nodes/"),
    "GA208": (edited(scale_above), "/skins/0"),
    "GA209": (with_tracks(steps([0, 100])), "/animations/0"),
    "GA210": (with_tracks(joint("scale", [[1, 1, 1], [1, 2, 1]])), "/nodes/"),
    "GA211": (with_tracks(joint("scale", [[1, 1, 1], [2, 2, 2]])), "/animations/0"),
    "GA212": (with_tracks(joint("translation", [[0, 1, 0], [0, 2, 0]])), "/animations/0"),
    "GA213": (edited(idle_joint), "/skins/0"),
    "GA215": (edited(wrong_hint), "/skins/0"),
    "GA216": (edited(strided_matrices), "/skins/0"),
    "GA301": (with_tracks(swing(pop)), "/animations/0"),
    "GA302": (with_tracks(swing(jump)), "/animations/0"),
    "GA303": (with_tracks(swing(tremble)), "/animations/0"),
    "GA304": (step_of(3.0), "/animations/0"),
    "GA305": (with_tracks(creeping(0.02)), "/animations/0"),
    "GA401": (opened_fixture("arm"), "/animations"),
    "GA402": (replace(checked(opened_fixture("arm")), budget={"clips": 0.0}), ""),
    "GA501": (edited(pointer_at_node), "/extensionsUsed"),
    "GA502": (edited(declared_pointer), "/animations/0"),
    "GA503": (with_tracks(spline(8.0)), "/animations/0"),
}
SOUND: dict[str, Document] = {
    "GA005": edited(joints_apart),
    "GA006": edited(put("animations/0/name", "walk")),
    "GA102": opened_fixture("morph_cube"),
    "GA109": with_tracks(WAVE_12),
    "GA111": with_tracks(steps([0, 1, 0, 1])),
    "GA212": with_tracks(swing()),
    "GA301": with_tracks(swing()),
    "GA302": with_tracks(swing()),
    "GA303": with_tracks(swing()),
    "GA304": step_of(0.0),
    "GA305": with_tracks(creeping(0.0)),
    "GA503": with_tracks(WAVE_12),
    "GA007": opened_fixture("morph_cube"),
    "GA107": with_tracks(steps([0, 1, 2, 1, 0])),
    "GA108": with_tracks(WAVE_12),
    "GA110": with_tracks(WAVE_12),
    "GA114": with_tracks(WAVE_12),
    "GA115": with_tracks(spline(0.1)),
    "GA116": with_tracks(joint("scale", [[1, 1, 1], [0.5, 1, 1]])),
    "GA117": with_tracks(joint("scale", [[1, 1, 1], [0.5, 1, 1]])),
    "GA118": with_weights([[0, 1, 0], [1, 0, 0]]),
    "GA210": with_tracks(joint("scale", [[1, 1, 1], [2, 2, 2]])),
    "GA211": with_tracks(joint("scale", [[1, 1, 1], [1, 1, 1]])),
}
PARAMETERS: dict[str, dict[str, str]] = {
    "GA006": {"pattern": "^[a-z]+$"},
    "GA119": {"targets": "0"},
    "GA203": {"joints": "1"},
    "GA401": {"bytes": "0", "fraction": "0"},
}
TARGETS = {"GA503": "unity"}
