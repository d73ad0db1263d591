"""Channels by JSON pointer → plain channels, where three.js then plays the same motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading import reader
from anim.gltf.validation.channel_targets import channel_target, has_weight_pointers
from anim.gltf.writing import writer
from anim.model import Clip
from anim.sampling.weight_pointers import resolve_weight_pointers
from anim.show.page.embedded_nodes import shown_nodes
from anim.units import FEW, list_some, plural


def resolve_pointers(document: Document) -> Document:
    """Return the document with plain channels of morph weights where pointers name a mesh's, or a single one.

    Not of clips in which one of several pointers to weights of a node jumps while others don't.
    """
    if not has_weight_pointers(document.json):
        return document
    skeleton, clips = reader.skeleton(document), reader.clips(document)
    resolved = ((i, clip, resolve_weight_pointers(skeleton, clip)) for i, clip in enumerate(clips))
    return writer.replace_clips(document, {i: new for i, old, new in resolved if new is not old and _is_storable(new)})


def rewrite_tracks(json: Json) -> list[str]:
    """Replace pointers to properties of nodes by plain channels, in place, and return notes about tracks not shown.

    Channels of nodes outside the default scene, or of a path that glTF does not know, lose their target: three.js
    finds none for them.
    """
    shown = shown_nodes(json)
    pointers: list[str] = []
    outside = 0
    for animation in json_array(json, "animations"):
        channels: list[Json] = []
        for channel in animation["channels"]:
            node, path, pointer = channel_target(channel) or (None, "", None)
            if node is not None:
                channels.append({**channel, "target": {"node": node, "path": path}} if pointer else channel)
            else:
                channels.append(channel)
                pointers += [] if pointer is None else [pointer]
        for i, channel in enumerate(channels):
            target, is_known = channel["target"], channel_target(channel) is not None
            if "node" in target and (not is_known or target["node"] not in shown):
                channels[i] = {**channel, "target": {key: target[key] for key in target if key != "node"}}
                outside += is_known
        animation["channels"] = channels
    return _notes(pointers, outside)


def _is_storable(clip: Clip) -> bool:
    """Return whether float32 tells the keys of every track apart; not those around jumps beside other motion."""
    return all((np.diff(axis.times.astype(np.float32)) > 0).all() for axis in clip.time_axes)


def _notes(pointers: Sequence[str], outside: int) -> list[str]:
    notes = []
    if pointers:
        notes.append(f"{plural(len(pointers), 'track')} not shown: {list_some(pointers, FEW)}")
    if outside:
        notes.append(f"{plural(outside, 'track')} not shown: of nodes outside the default scene")
    return notes
