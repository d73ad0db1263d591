"""Clips → a new Document with replaced animations.

Everything else keeps its JSON, order and indices. Accessors and views that only the replaced animations used are reused
for the new ones, and their old bytes are dropped from the buffer. An unused index inside a list gets the smallest valid
placeholder, so that no other index changes.
"""

from __future__ import annotations

import operator
from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from anim.arrays import Identity
from anim.errors import AnimError, NotFoundError, RangeError, ShapeError, check_type
from anim.gltf.document import Document, Json, copy_json, json_array
from anim.gltf.meshopt.storage import EncodedTrack, check_extension
from anim.gltf.reading import reader
from anim.gltf.reading.node_matrix import expand_matrices
from anim.gltf.validation import channel_targets
from anim.gltf.writing import encoding, unit_rotations
from anim.gltf.writing.encoding import AccessorData
from anim.gltf.writing.insertion import PendingIndex, insert_accessors
from anim.model import Clip, Interpolation, TimeAxis, Track

_SAMPLER_KEYS = ("input", "output", "interpolation")


def replace_clips(document: Document, clips: Mapping[int, Clip], *, extension: str = "") -> Document:
    """Return a new document with the animations in `clips` replaced, by index; others are unchanged.

    Its JSON is a copy, which can be edited without changing the old document. Without clips the document itself is
    returned.

    Unsupported channels are kept with their samplers; channels without a track are removed; tracks without a channel
    get one, and their nodes TRS instead of a `matrix`. With a pointer track, `extensionsUsed` has its extension.
    Names, extras and extensions of animations, channels and samplers are kept; name, extras and index of an accessor
    if its keys replace those of exactly one.
    Rotation keys are normalized, with their tangents, unless the track was not unit in the document before.
    extension: meshopt extension that compresses new views where that is smaller, empty for none. An `EncodedTrack` is
    stored as its codes.
    Raises RangeError for keys equal in float32, a zero rotation, no remaining channel, or a weight count other than the
    node's morph targets; NotFoundError for an unknown animation or node.
    replace_clips(document, {0: clip}): the first animation becomes `clip`
    """
    new = replace_sharing(document, clips, extension=extension)
    return new if new is document else replace(new, json=copy_json(new.json))


def replace_sharing(document: Document, clips: Mapping[int, Clip], *, extension: str = "") -> Document:
    """Return the document of `replace_clips`, but with objects in its JSON that are those of `document`.

    For documents that are written and not edited in place: a copy of the JSON of many nodes takes time and memory.
    """
    check_type(document, Document, "document")
    if not clips:
        return document
    check_type(clips, Mapping, "clips", help="clips by index: {0: clip}")
    count = len(json_array(document.json, "animations"))
    clips = {_check_index(number, count): clip for number, clip in clips.items()}
    for clip in clips.values():
        check_type(clip, Clip, "a clip")
    check_extension(extension)
    clips = unit_rotations.normalize_new(document, clips)
    pool = _ContentPool()
    animations = [
        _replace_animation(document.json, animation, clips[i], i, pool) if i in clips else animation
        for i, animation in enumerate(json_array(document.json, "animations"))
    ]
    written = insert_accessors(document, animations, set(clips), pool.contents, extension, pool.sources)
    json = expand_matrices(written.json)[0]
    if any(track.pointer is not None for clip in clips.values() for track in clip.tracks):
        json = _name_extension(json, channel_targets.EXTENSION)
    return replace(written, json=json)


def _name_extension(json: Json, name: str) -> Json:
    """The JSON with an extension in `extensionsUsed`: glTF requires it there."""
    used: list[str] = json.get("extensionsUsed", [])
    return json if name in used else {**json, "extensionsUsed": [*used, name]}


def _check_index(number: object, count: int) -> int:
    """The index of an animation as int. Raises ShapeError or NotFoundError."""
    try:
        if isinstance(number, bool):
            raise TypeError
        found = operator.index(number)  # type: ignore[arg-type]
    except TypeError:
        raise ShapeError(
            f"clips has the key {number!r} (expected the number of an animation)",
            help="gltf.read.names(document) lists the names in the order of the numbers",
        ) from None
    if not 0 <= found < count:
        raise NotFoundError(f"there is no clip #{found} (the file has {count}, from #0 on)")
    return found


class _ContentPool:
    """Contents of new accessors, without duplicates; samplers refer to them by PendingIndex."""

    def __init__(self) -> None:
        self.contents: list[AccessorData] = []
        self.sources: list[set[int]] = []  # for each content, the accessors of the samplers that it replaces
        self._indices: dict[AccessorData, int] = {}
        self._time_axes: dict[TimeAxis, int] = {}
        self._values: dict[tuple[object, ...], int] = {}
        self._digests: dict[Identity, bytes] = {}  # by values and tangents

    def _add(self, content: AccessorData) -> int:
        index = self._indices.get(content)
        if index is None:
            index = self._indices[content] = len(self.contents)
            self.contents.append(content)
            self.sources.append(set())
        elif self.contents[index].filtered is None:  # codes also apply to an equal content without
            self.contents[index] = content
        return index

    def values(self, track: Track) -> int:
        """The pending index of a track's values; equal values, on whatever nodes, are encoded once."""
        codes = track.codes if isinstance(track, EncodedTrack) else None
        key = track.path, track.interpolation, track.storage, codes, track.values.shape, self._digest(track)
        if key not in self._values:
            self._values[key] = self._add(encoding.values(track))
        return self._values[key]

    def _digest(self, track: Track) -> bytes:
        """Digest of a track's values; those that many tracks share are read once."""
        shared = Identity(track.values, track.in_tangents, track.out_tangents)
        if shared not in self._digests:
            self._digests[shared] = _value_digest(track)
        return self._digests[shared]

    def time_axis(self, track: Track) -> int:
        """The pending index of a track's times; those of a shared axis are encoded once."""
        axis = track.time_axis
        if axis not in self._time_axes:
            self._time_axes[axis] = self._add(encoding.times(axis))
        return self._time_axes[axis]


def _value_digest(track: Track) -> bytes:
    import hashlib  # loads OpenSSL

    digest = hashlib.blake2b(digest_size=16)
    for numbers in (track.values, track.in_tangents, track.out_tangents):
        if numbers is not None:
            digest.update(np.ascontiguousarray(numbers).data)
    return digest.digest()


def _replace_animation(json: Json, animation: Json, clip: Clip, number: int, pool: _ContentPool) -> Json:
    try:
        for track in clip.tracks:
            _check_target(json, track)
        return _animation(animation, clip, pool)
    except AnimError as error:
        raise error.at(reader.clip_label(clip.name, number)) from None


def _animation(animation: Json, clip: Clip, pool: _ContentPool) -> Json:
    waiting: dict[tuple[int | None, str], deque[Track]] = {}
    for track in clip.tracks:
        waiting.setdefault(track.target, deque()).append(track)
    samplers = _Samplers(animation, pool)
    channels = []
    for channel in animation["channels"]:
        target = channel_targets.channel_target(channel)
        if target is None:
            channels.append({**channel, "sampler": samplers.keep(channel["sampler"])})
            continue
        node, path, pointer = target
        queue = waiting.get((None, pointer or "") if node is None else (node, path))
        if queue:
            channels.append({**channel, "sampler": samplers.new(queue.popleft(), channel["sampler"])})
    for queue in waiting.values():
        channels += [{"sampler": samplers.new(track, None), "target": _target(track)} for track in queue]
    if not channels:
        if animation["channels"]:
            raise RangeError("has no track left (glTF knows no animation without channels)")
        return animation
    replaced = {**animation, "channels": channels, "samplers": samplers.list}
    if clip.name != animation.get("name", ""):
        replaced["name"] = clip.name
    return replaced


class _Samplers:
    """Samplers of one new animation; equal ones are shared unless they have names, extras or extensions."""

    def __init__(self, animation: Json, pool: _ContentPool) -> None:
        self.list: list[Json] = []
        self._old = animation["samplers"]
        self._pool = pool
        self._indices: dict[tuple[object, ...], int] = {}

    def keep(self, old: int) -> int:
        return self._add(("kept", old), self._old[old])

    def new(self, track: Track, old: int | None) -> int:
        try:
            times, values = self._pool.time_axis(track), self._pool.values(track)
        except AnimError as error:
            raise error.at(_label(track)) from None
        if old is not None:
            self._pool.sources[times].add(self._old[old]["input"])
            self._pool.sources[values].add(self._old[old]["output"])
        own = {} if old is None else {k: v for k, v in self._old[old].items() if k not in _SAMPLER_KEYS}
        sampler: Json = {"input": PendingIndex(times), "output": PendingIndex(values), **own}
        if track.interpolation is not Interpolation.LINEAR:
            sampler["interpolation"] = str(track.interpolation)
        return self._add((times, values, track.interpolation, old if own else None), sampler)

    def _add(self, key: tuple[object, ...], sampler: Json) -> int:
        index = self._indices.get(key)
        if index is None:
            index = self._indices[key] = len(self.list)
            self.list.append(sampler)
        return index


def _check_target(json: Json, track: Track) -> None:
    if track.node is not None:
        try:
            channel_targets.check_node(json, track.node, track.path, track.values.shape[1])
        except AnimError as error:
            raise error.at(_label(track)) from None


def _label(track: Track) -> str:
    return f"{track.path} of node {track.node}" if track.pointer is None else track.pointer


def _target(track: Track) -> Json:
    if track.pointer is not None:
        return {"path": "pointer", "extensions": {channel_targets.EXTENSION: {"pointer": track.pointer}}}
    return {"node": track.node, "path": track.path}
