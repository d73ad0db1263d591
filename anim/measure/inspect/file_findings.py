"""Findings on the structure of a file: stable names, severities, and advice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from anim.errors import AnimError
from anim.gltf.document import Document, Json, json_array, node_label
from anim.gltf.reading import reader
from anim.gltf.validation import buffer_layout, channel_targets, hierarchy
from anim.gltf.validation.schema import TOP_ARRAYS

INVALID = "invalid"  # finding for input that other commands refuse
MAX_LISTED_FAULTS = 10  # maximum number of listed faults of a file


class Severity(StrEnum):
    """Severity: invalid glTF, which players may refuse; a likely mistake; a waste or a remark."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding.

    name: stable, in kebab-case. where: part of the file. problem: the observation. advice: the remedy.
    """

    name: str
    severity: Severity
    where: str
    problem: str
    advice: str


def fault_findings(faults: Sequence[AnimError]) -> Iterator[Finding]:
    """Yield a finding for each of the first faults for which other commands refuse a file."""
    for fault in faults[:MAX_LISTED_FAULTS]:
        advice = fault.help or "fix it where the file is made; other commands refuse it"
        yield Finding(INVALID, Severity.ERROR, fault.where or "file", fault.problem, advice)
    if len(faults) > MAX_LISTED_FAULTS:
        problem = f"{len(faults) - MAX_LISTED_FAULTS} more faults"
        yield Finding(INVALID, Severity.ERROR, "file", problem, "fix the first ones, and inspect again")


def document_findings(document: Document) -> Iterator[Finding]:
    """Yield findings on faults of structure for which no command refuses a file."""
    json = document.json
    for key in sorted(TOP_ARRAYS):
        if json.get(key) == []:
            yield Finding(
                "empty-array", Severity.ERROR, key, "is an empty array", "leave the property out where the file is made"
            )
    yield from _of_accessors(json)
    yield from _of_samplers(json)
    yield from _of_clip_names(json)
    yield from _of_skins(json)
    if document.expanded:
        more = len(document.expanded) - 1
        problem = "has a matrix and is animated" + (f", as {more} more nodes" if more else "")
        where = node_label(json, document.expanded[0])
        yield Finding(
            "animated-matrix",
            Severity.ERROR,
            where,
            problem,
            "to decompose the matrix: gltf-anim convert IN OUT",
        )
    for name in json.get("extensionsRequired", ()):
        if name not in KNOWN_REQUIRED:
            problem = f"{name} is required but not supported here"
            yield Finding("unknown-extension", Severity.WARNING, "extensionsRequired", problem, _PASSES)


KNOWN_REQUIRED = frozenset(
    """
    EXT_mesh_gpu_instancing EXT_meshopt_compression EXT_texture_webp KHR_animation_pointer KHR_draco_mesh_compression
    KHR_lights_punctual KHR_materials_unlit KHR_mesh_quantization KHR_meshopt_compression KHR_node_visibility
    KHR_texture_basisu KHR_texture_transform
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)
_PASSES = "it stays unchanged; check the result in a viewer that supports it"


def _of_accessors(json: Json) -> Iterator[Finding]:
    for i, accessor in enumerate(json_array(json, "accessors")):
        if accessor.get("normalized") and accessor["componentType"] in (5125, 5126):
            where, problem = f"accessor {i}", "floats are marked normalized"
            yield Finding(
                "normalized-float", Severity.ERROR, where, problem, "leave the property out where the file is made"
            )
        if accessor["type"] not in buffer_layout.COMPONENTS:
            problem = f"type is '{accessor['type']}'"
            advice = "use one of glTF's types where the file is made"
            yield Finding("unknown-type", Severity.WARNING, f"accessor {i}", problem, advice)


def badly_stored(json: Json) -> frozenset[int]:
    """Return the indices of clips with unused samplers, or with keys stored against the specification.

    Commands that edit clips rewrite them, even if no key changes.
    """
    faults = (_unbounded, _strided, _idle)
    return frozenset(i for i, each in enumerate(json_array(json, "animations")) if any(f(json, each) for f in faults))


_REWRITE = "to rewrite them without other changes: gltf-anim retime IN OUT --speed 1"


def _of_samplers(json: Json) -> Iterator[Finding]:
    clips = json_array(json, "animations")
    for i, animation in enumerate(clips):
        where = reader.clip_label(animation.get("name", ""), i)
        if idle := _idle(json, animation):
            yield Finding("unused-samplers", Severity.INFO, where, f"{len(idle)} samplers in no channel", _REWRITE)
        ignored = sum(channel_targets.channel_target(channel) is None for channel in animation["channels"])
        if ignored:
            problem = f"{ignored} channels with an unknown target"
            yield Finding("ignored-channels", Severity.INFO, where, problem, "players skip them; they stay unchanged")
    unbounded, strided = (set().union(*(fault(json, each) for each in clips)) for fault in (_unbounded, _strided))
    if unbounded:
        problem = f"{len(unbounded)} key time accessors without min and max"
        yield Finding("missing-bounds", Severity.ERROR, "animations", problem, _REWRITE)
    if strided:
        problem = f"{len(strided)} accessors are in views with byteStride"
        yield Finding("strided-animation", Severity.ERROR, "animations", problem, _REWRITE)


def _idle(json: Json, animation: Json) -> set[int]:
    """Indices of a clip's samplers without a channel."""
    del json
    return set(range(len(animation["samplers"]))) - {channel["sampler"] for channel in animation["channels"]}


def _unbounded(json: Json, animation: Json) -> set[int]:
    """Indices of a clip's accessors of key times without min and max."""
    accessors = json_array(json, "accessors")
    return {n for s in animation["samplers"] if not {"min", "max"} <= accessors[n := s["input"]].keys()}


def _strided(json: Json, animation: Json) -> set[int]:
    """Indices of a clip's accessors in buffer views with byteStride, which is for vertex attributes."""
    accessors, views = json_array(json, "accessors"), json_array(json, "bufferViews")
    named = {sampler[key] for sampler in animation["samplers"] for key in ("input", "output")}
    return {n for n in named if _has_stride(accessors[n], views)}


def _of_clip_names(json: Json) -> Iterator[Finding]:
    by_name: dict[str, list[int]] = {}
    for i, animation in enumerate(json_array(json, "animations")):
        by_name.setdefault(animation.get("name", ""), []).append(i)
    for name, numbers in by_name.items():
        if name and len(numbers) > 1:
            problem = f"{len(numbers)} clips have this name (numbers {', '.join(map(str, numbers))})"
            advice = f"players find one of them by this name (here the last is '#{numbers[-1]}'); rename it"
            yield Finding("duplicate-clip-names", Severity.WARNING, f"clip '{name}'", problem, advice)


def _has_stride(accessor: Json, views: list[Json]) -> bool:
    return "bufferView" in accessor and "byteStride" in views[accessor["bufferView"]]


def _of_skins(json: Json) -> Iterator[Finding]:
    skins = json_array(json, "skins")
    if not skins:
        return
    parents = hierarchy.parents(json)
    for i, skin in enumerate(skins):
        where = reader.clip_label(skin.get("name", ""), i, "skin")
        common = set.intersection(*(set(_ancestors(joint, parents)) for joint in skin["joints"]))
        if not common:
            problem = "joints have no common root"
            yield Finding("no-common-root", Severity.ERROR, where, problem, "put them under one node where it is made")
        elif "skeleton" in skin and skin["skeleton"] not in common:
            problem = f"skeleton names node {skin['skeleton']}, which is not above all joints"
            advice = "players ignore the property; leave it out where the skin is made"
            yield Finding("skeleton-hint", Severity.WARNING, where, problem, advice)
        accessor = skin.get("inverseBindMatrices")
        if accessor is not None and _has_stride(
            json_array(json, "accessors")[accessor], json_array(json, "bufferViews")
        ):
            problem = "inverse bind matrices are in a view with byteStride"
            yield Finding(
                "strided-matrices", Severity.ERROR, where, problem, "give them a separate view where it is made"
            )


def _ancestors(node: int, parents: list[int]) -> Iterator[int]:
    while node >= 0:
        yield node
        node = parents[node]
