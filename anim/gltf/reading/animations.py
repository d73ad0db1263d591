"""Channel + sampler → Track, by glTF 2.0, 3.11, and KHR_animation_pointer."""

from __future__ import annotations

from functools import cache

import numpy as np

from anim import arrays
from anim.arrays import Floats
from anim.errors import AnimError, FormatError, RangeError, ShapeError
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.accessors import FLOAT, Accessors
from anim.gltf.validation import channel_targets
from anim.model import AccessorFormat, Interpolation, TimeAxis, Track
from anim.model.track import NUM_COMPONENTS

INTERPOLATIONS = {name.value: name for name in Interpolation}
TYPES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}
FRACTIONS = (5120, 5121, 5122, 5123)  # component types allowed for normalized rotations and weights


class Reader:
    """Reader of one document's tracks.

    Tracks on one input accessor share one time axis; equal channels, of many clips, share one track; keys on many nodes
    are read and checked once.
    """

    def __init__(self, document: Document, accessors: Accessors) -> None:
        self._nodes = json_array(document.json, "nodes")
        self._json = document.json
        self._accessors = accessors
        self._time_axes: dict[int, TimeAxis] = {}
        self._values: dict[int, Floats] = {}
        self._tracks: dict[tuple[object, ...], Track] = {}
        self._of_any_node: dict[tuple[object, ...], Track] = {}

    def track(self, animation: Json, number: int) -> Track | None:
        """Return a channel of `animation` as a track, None without a supported target."""
        channel = animation["channels"][number]
        found = channel_targets.channel_target(channel)
        if found is None:
            return None
        sampler = animation["samplers"][channel["sampler"]]
        keys = sampler["input"], sampler["output"], sampler.get("interpolation")
        if (found, keys) in self._tracks:
            return self._tracks[found, keys]
        node, path, address = found
        alike = self._of_any_node.get((path, keys)) if address is None else None
        if alike is not None and node is not None:
            return self._tracks.setdefault((found, keys), alike.on_node(node))
        try:
            track = self._track(sampler, node, path, address)
            if address is None and path in NUM_COMPONENTS:  # others depend on the node
                self._of_any_node[path, keys] = track
            return self._tracks.setdefault((found, keys), track)
        except AnimError as error:
            if isinstance(error, RangeError | ShapeError):  # caused by the file, not by a caller
                error = FormatError(error.problem, where=error.where, help=error.help)
            raise error.at(f"track {number} ({self._target_label(node, path, address)})", ": ") from None

    def _track(self, sampler: Json, node: int | None, path: str, address: str | None) -> Track:
        name = sampler.get("interpolation", "LINEAR")
        interpolation = INTERPOLATIONS.get(name)
        if interpolation is None:
            raise FormatError(f"interpolation is '{name}' (expected STEP, LINEAR or CUBICSPLINE)")
        axis = self._axis(sampler["input"])
        output = self._accessors.about(sampler["output"])
        width = self._width(node, path, output)
        cubic = interpolation is Interpolation.CUBICSPLINE
        if cubic and len(axis) < 2:
            raise FormatError("CUBICSPLINE with one key (expected at least two)")
        values = self._values.get(sampler["output"])
        if values is None:
            values = arrays.freeze(self._accessors.unchecked(sampler["output"]))
            self._values[sampler["output"]] = values
        rows = len(axis) * (3 if cubic else 1)
        if width is None:  # a pointer: an array of elements per key if the count requires it
            width = values.size // rows
        if values.size != rows * width or not width:
            raise FormatError(
                f"output accessor {sampler['output']} has {values.size} numbers (expected {rows * (width or 1)} for "
                f"{len(axis)} keys{' with tangents' if cubic else ''} of {width or 'at least one'})"
            )
        storage = _storage(output["componentType"], bool(output.get("normalized")), output["type"])
        if not cubic:
            keys = values.reshape(len(axis), width)
            if path == "rotation":
                _check_rotations(keys)
            return Track(node, path, interpolation, axis, keys, pointer=address, storage=storage)
        parts = values.reshape(len(axis), 3, width)
        if path == "rotation":
            _check_rotations(parts[:, 1])
        return Track(
            node, path, interpolation, axis, parts[:, 1], parts[:, 0], parts[:, 2], pointer=address, storage=storage
        )

    def _axis(self, index: int) -> TimeAxis:
        found = self._time_axes.get(index)
        if found is None:
            about = self._accessors.about(index)
            if about["type"] != "SCALAR" or about["componentType"] != FLOAT:
                got = f"{about['type']} of {about['componentType']}"
                raise FormatError(f"input accessor {index} is {got} (expected SCALAR of {FLOAT})")
            try:
                found = TimeAxis(arrays.freeze(self._accessors.floats(index))[:, 0])
            except AnimError as error:
                raise FormatError(error.problem, where=error.where, help=error.help) from None
            self._time_axes[index] = found
        return found

    def _width(self, node: int | None, path: str, output: Json) -> int | None:
        """Components per key, None if only the data determines it; checks the output's type."""
        if path == "pointer":
            return None
        if output["type"] != TYPES[path]:
            raise FormatError(f"output accessor is {output['type']} (expected {TYPES[path]})")
        component_type, normalized = output["componentType"], output.get("normalized", False)
        fractions = path in ("rotation", "weights") and component_type in FRACTIONS and normalized
        if component_type != FLOAT and not fractions:
            raise FormatError(f"output accessor has component type {component_type} (expected {FLOAT}, or normalized)")
        return NUM_COMPONENTS[path] if path != "weights" else self._target_count(node)

    def _target_count(self, node: int | None) -> int:
        count = channel_targets.target_count(self._json, node) if node is not None else 0
        if not count:
            raise FormatError("animates weights of a node without morph targets")
        return count

    def _target_label(self, node: int | None, path: str, address: str | None) -> str:
        if node is None:
            return address or "no target"
        name = self._nodes[node].get("name", "") if node < len(self._nodes) else ""
        return f"node {node}{f' {name!r}' if name else ''}, {path}"


def _check_rotations(keys: Floats) -> None:
    if np.count_nonzero(keys[:, 3]) == len(keys):  # w is rarely 0; a twentieth of the time of what follows
        return
    if not keys.any(axis=1).all():
        raise FormatError(f"rotation at key {int(keys.any(axis=1).argmin())} is zero (expected a unit quaternion)")


@cache
def _storage(component_type: int, normalized: bool, element: str) -> AccessorFormat:
    return AccessorFormat(component_type, normalized, element)
