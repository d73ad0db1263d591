"""Findings: what is not as it should be, under a name, with what to do about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from anim.gltf import hierarchy, layout, targets
from anim.gltf.document import Json, items
from anim.gltf.structure import TOP_ARRAYS


class Severity(StrEnum):
    """How bad: not legal glTF; legal but likely wrong; only wasteful or worth knowing."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


@dataclass(frozen=True, slots=True)
class Finding:
    """name: stable, in kebab-case. where: the part of the file. problem: what was seen. advice: what to do."""

    name: str
    severity: Severity
    where: str
    problem: str
    advice: str


def of_json(json: Json) -> Iterator[Finding]:
    """Yield faults of the file's structure that leave its meaning clear, so that no command refuses it."""
    for key in sorted(TOP_ARRAYS):
        if json.get(key) == []:
            yield Finding("empty-array", Severity.ERROR, key, "is an empty array", "leave the property out")
    yield from _of_accessors(json)
    yield from _of_samplers(json)
    yield from _of_skins(json)
    for name in json.get("extensionsRequired", ()):
        if name not in KNOWN_REQUIRED:
            problem = f"{name} is required and not known here"
            yield Finding("unknown-extension", Severity.WARNING, "extensionsRequired", problem, _PASSES)


KNOWN_REQUIRED = frozenset(
    """
    EXT_mesh_gpu_instancing EXT_meshopt_compression EXT_texture_webp KHR_animation_pointer KHR_draco_mesh_compression
    KHR_lights_punctual KHR_materials_unlit KHR_mesh_quantization KHR_meshopt_compression KHR_node_visibility
    KHR_texture_basisu KHR_texture_transform
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)
_PASSES = "it passes through untouched; check the result in a viewer that knows it"


def _of_accessors(json: Json) -> Iterator[Finding]:
    for i, accessor in enumerate(items(json, "accessors")):
        if accessor.get("normalized") and accessor["componentType"] in (5125, 5126):
            where = f"accessor {i}"
            yield Finding("normalized-float", Severity.ERROR, where, "floats are marked normalized", "drop the mark")
        if accessor["type"] not in layout.COMPONENTS:
            problem = f"type is '{accessor['type']}'"
            yield Finding("unknown-type", Severity.WARNING, f"accessor {i}", problem, "use one of glTF's types")


def _of_samplers(json: Json) -> Iterator[Finding]:
    accessors, views = items(json, "accessors"), items(json, "bufferViews")
    strided: set[int] = set()
    unbounded: set[int] = set()
    for i, animation in enumerate(items(json, "animations")):
        used = {channel["sampler"] for channel in animation["channels"]}
        idle = len(animation["samplers"]) - len(used)
        where = f"clip '{animation['name']}'" if animation.get("name") else f"clip {i}"
        if idle > 0:
            yield Finding("unused-samplers", Severity.INFO, where, f"{idle} samplers in no channel", "rewrite the clip")
        ignored = sum(targets.of_channel(channel) is None for channel in animation["channels"])
        if ignored:
            problem = f"{ignored} channels without a target that is known"
            yield Finding("ignored-channels", Severity.INFO, where, problem, "players skip them; they are kept")
        inputs = {sampler["input"] for sampler in animation["samplers"]}
        unbounded |= {n for n in inputs if not {"min", "max"} <= accessors[n].keys()}
        named = inputs | {sampler["output"] for sampler in animation["samplers"]}
        strided |= {n for n in named if _has_stride(accessors[n], views)}
    if unbounded:
        problem = f"{len(unbounded)} key time accessors without min and max"
        yield Finding(
            "missing-bounds", Severity.ERROR, "animations", problem, "any command that rewrites them adds both"
        )
    if strided:
        problem = f"{len(strided)} accessors lie in views with byteStride"
        yield Finding(
            "strided-animation", Severity.ERROR, "animations", problem, "any command that rewrites them mends it"
        )


def _has_stride(accessor: Json, views: list[Json]) -> bool:
    return "bufferView" in accessor and "byteStride" in views[accessor["bufferView"]]


def _of_skins(json: Json) -> Iterator[Finding]:
    skins = items(json, "skins")
    if not skins:
        return
    parents = hierarchy.parents(json)
    for i, skin in enumerate(skins):
        where = f"skin {i}"
        common = set.intersection(*(set(_ancestors(joint, parents)) for joint in skin["joints"]))
        if not common:
            problem = "joints have no common root"
            yield Finding("no-common-root", Severity.ERROR, where, problem, "put them under one node")
        elif "skeleton" in skin and skin["skeleton"] not in common:
            problem = f"skeleton names node {skin['skeleton']}, which is not above all joints"
            yield Finding("skeleton-hint", Severity.ERROR, where, problem, "drop the property; it is only a hint")
        accessor = skin.get("inverseBindMatrices")
        if accessor is not None and _has_stride(items(json, "accessors")[accessor], items(json, "bufferViews")):
            problem = "inverse bind matrices lie in a view with byteStride"
            yield Finding("strided-matrices", Severity.ERROR, where, problem, "give them a view of their own")


def _ancestors(node: int, parents: list[int]) -> Iterator[int]:
    while node >= 0:
        yield node
        node = parents[node]
