"""Storage of animations against the specification: unused samplers, missing bounds, strided views."""

from __future__ import annotations

from collections.abc import Iterable

from anim.gltf.document import Json, json_array


def badly_stored(json: Json) -> frozenset[int]:
    """Return the indices of clips with unused samplers, or with keys stored against the specification.

    Commands that edit clips rewrite them, even if no key changes.
    """
    clips = json_array(json, "animations")
    has_others = bool(unbounded(json, *clips) or strided(json, *clips))  # few files have any
    return frozenset(
        i
        for i, each in enumerate(clips)
        if unused_samplers(each) or (has_others and (unbounded(json, each) or strided(json, each)))
    )


def unused_samplers(animation: Json) -> set[int]:
    """Return the indices of a clip's samplers without a channel."""
    return set(range(len(animation["samplers"]))) - {channel["sampler"] for channel in animation["channels"]}


def unbounded(json: Json, *animations: Json) -> set[int]:
    """Return the indices of clips' accessors of key times without min and max."""
    accessors = json_array(json, "accessors")
    inputs = {sampler["input"] for animation in animations for sampler in animation["samplers"]}
    return {i for i in inputs if not {"min", "max"} <= accessors[i].keys()}


def strided(json: Json, *animations: Json) -> set[int]:
    """Return the indices of clips' accessors in buffer views with byteStride (for vertex attributes)."""
    samplers = [sampler for animation in animations for sampler in animation["samplers"]]
    return with_stride(json, {sampler[key] for sampler in samplers for key in ("input", "output")})


def with_stride(json: Json, numbers: Iterable[int]) -> set[int]:
    """Return those of the accessors with these indices that are in a buffer view with byteStride."""
    views = json_array(json, "bufferViews")
    named = ((i, json["accessors"][i]) for i in numbers)
    return {i for i, about in named if "bufferView" in about and "byteStride" in views[about["bufferView"]]}
