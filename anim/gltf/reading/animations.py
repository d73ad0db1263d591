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
        samplers = [each for animation in json_array(document.json, "animations") for each in animation["samplers"]]
        self._plain = accessors.plain_floats(each[key] for each in samplers for key in ("input", "output"))
        self._others: dict[int, Floats] = {}  # values of other accessors
        self._tracks: dict[tuple[object, ...], dict[int | None, Track]] = {}  # by target and keys, by node

    def track(self, animation: Json, number: int) -> Track | None:
        """Return a channel of `animation` as a track, None without a supported target."""
        channel = animation["channels"][number]
        found = channel_targets.channel_target(channel)
        if found is None:
            return None
        node, path, address = found
        sampler = animation["samplers"][channel["sampler"]]
        keys = path, address, sampler["input"], sampler["output"], sampler.get("interpolation")
        alike = self._tracks.setdefault(keys, {})
        if node in alike:
            return alike[node]
        try:
            if alike and node is not None and path in NUM_COMPONENTS:  # other paths depend on the node
                track = next(iter(alike.values())).on_node(node)
            else:
                track = self._track(sampler, node, path, address)
        except AnimError as error:
            if isinstance(error, RangeError | ShapeError):  # caused by the file, not by a caller
                error = FormatError(error.problem, where=error.where, help=error.help)
            raise error.at(f"track {number} ({self._target_label(node, path, address)})", ": ") from None
        alike[node] = track
        return track

    def _track(self, sampler: Json, node: int | None, path: str, address: str | None) -> Track:
        name = sampler.get("interpolation", "LINEAR")
        interpolation = INTERPOLATIONS.get(name)
        if interpolation is None:
            raise FormatError(f"interpolation is '{name}' (expected STEP, LINEAR or CUBICSPLINE)")
        number = sampler["output"]
        axis = self._time_axes.get(sampler["input"])
        if axis is None:
            axis = self._axis(sampler["input"])
        count = len(axis.times)
        output = self._accessors.about(number)
        storage = _storage(path, output["componentType"], output.get("normalized", False), output["type"])
        # components per key; None if only the data determines it
        width = None if path == "pointer" else NUM_COMPONENTS.get(path) or self._target_count(node)
        cubic = interpolation is Interpolation.CUBICSPLINE
        if cubic and count < 2:
            raise FormatError("CUBICSPLINE with one key (expected at least two)")
        plain = self._plain.get(number)
        values = self._other(number) if plain is None else plain
        rows = count * (3 if cubic else 1)
        if width is None:  # a pointer: an array of elements per key if the count requires it
            width = values.size // rows
        if values.size != rows * width or not width:
            raise FormatError(
                f"output accessor {number} has {values.size} numbers (expected {rows * (width or 1)} for "
                f"{count} keys{' with tangents' if cubic else ''} of {width or 'at least one'})"
            )
        make = Track if plain is None else Track.unchecked
        if not cubic:
            keys = values.reshape(count, width)
            if path == "rotation":
                _check_rotations(keys)
            return make(node, path, interpolation, axis, keys, None, None, address, storage)
        parts = values.reshape(count, 3, width)
        if path == "rotation":
            _check_rotations(parts[:, 1])
        return make(node, path, interpolation, axis, parts[:, 1], parts[:, 0], parts[:, 2], address, storage)

    def _other(self, index: int) -> Floats:
        found = self._others.get(index)
        if found is None:
            found = self._others[index] = arrays.freeze(self._accessors.unchecked(index))
        return found

    def _axis(self, index: int) -> TimeAxis:
        about = self._accessors.about(index)
        if about["type"] != "SCALAR" or about["componentType"] != FLOAT:
            got = f"{about['type']} of {about['componentType']}"
            raise FormatError(f"input accessor {index} is {got} (expected SCALAR of {FLOAT})")
        plain = self._plain.get(index)
        try:
            times = arrays.freeze(self._accessors.floats(index))[:, 0] if plain is None else plain
            found = self._time_axes[index] = TimeAxis(times)
        except AnimError as error:
            raise FormatError(error.problem, where=error.where, help=error.help) from None
        return found

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
def _storage(path: str, component_type: int, normalized: bool, element: str) -> AccessorFormat:
    """Format of an output accessor. Raises FormatError for one that its path does not allow."""
    if path != "pointer" and element != TYPES[path]:
        raise FormatError(f"output accessor is {element} (expected {TYPES[path]})")
    fractions = path in ("rotation", "weights") and component_type in FRACTIONS and normalized
    if path != "pointer" and component_type != FLOAT and not fractions:
        raise FormatError(f"output accessor has component type {component_type} (expected {FLOAT}, or normalized)")
    return AccessorFormat(component_type, normalized, element)
