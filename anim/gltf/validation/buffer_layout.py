"""Check that accessors fit their views and views their buffers, before buffers are opened."""

from __future__ import annotations

from functools import cache
from typing import Any

from anim.errors import AnimError, FormatError, UnsupportedError
from anim.gltf.document import Json, json_array

COMPONENT_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # bytes by componentType
COMPONENTS = {"SCALAR": (1, 1), "VEC2": (1, 2), "VEC3": (1, 3), "VEC4": (1, 4)}  # (columns, rows) by type
COMPONENTS |= {"MAT2": (2, 2), "MAT3": (3, 3), "MAT4": (4, 4)}
MAX_ZERO_FILLED_COMPONENTS = 2**23  # components of an accessor without data; nothing in the file bounds its size
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"


def check(json: Json) -> None:
    """Raise FormatError at the first view or accessor that exceeds its bounds or is misaligned."""
    buffers, views = json_array(json, "buffers"), json_array(json, "bufferViews")
    for i, view in enumerate([] if _are_plain(views, buffers) else views):
        try:
            _check_view(view, buffers)
        except FormatError as error:
            raise error.at(f"bufferViews[{i}]", ".") from None
    for i, accessor in enumerate(json_array(json, "accessors")):
        try:
            _check_accessor(accessor, views)
        except AnimError as error:
            raise error.at(f"accessors[{i}]", ".") from None


def element(component_type: int, kind: str) -> tuple[int, int, int]:
    """Return (columns, rows, bytes per column) of one element.

    Matrix columns start on 4-byte boundaries.
    """
    columns, rows = COMPONENTS[kind]
    size = rows * COMPONENT_SIZES[component_type]
    return columns, rows, (size + 3) & ~3 if columns > 1 else size


@cache
def element_size(component_type: int, kind: str) -> int:
    """Return the bytes of one element, including the padding of a matrix's last column."""
    columns, _, column = element(component_type, kind)
    return columns * column


def compression(view: Json) -> Json | None:
    """Return the meshopt extension object of a view, None for an uncompressed one.

    Raises FormatError for null instead of an object.
    """
    extensions = view.get("extensions")
    if not extensions:
        return None
    for name in MESHOPT:
        if name in extensions:
            found: Json | None = extensions[name]
            if found is None:
                raise FormatError("is no object", where="extensions.meshopt")
            return found
    return None


def _are_plain(views: list[Json], buffers: list[Json]) -> bool:
    """Return True if all views are within their buffers and have nothing else to check, as in most files."""
    lengths = [buffer["byteLength"] for buffer in buffers]
    if any(view.get("byteOffset", 0) + view["byteLength"] > lengths[view["buffer"]] for view in views):
        return False
    return not any("byteStride" in view or "extensions" in view for view in views)


def _check_view(view: Json, buffers: list[Json]) -> None:
    _check_range(view, view["byteLength"], buffers[view["buffer"]]["byteLength"])
    stride = view.get("byteStride")
    if stride is not None and not (stride <= 252 and stride % 4 == 0) and compression(view) is None:
        raise FormatError(f"is {stride} (expected 4 to 252, a multiple of 4)", where="byteStride")
    compressed = compression(view)
    if compressed is not None:
        _check_compressed(compressed, buffers)


def _check_compressed(compressed: Any, buffers: list[Json]) -> None:
    where = "extensions.meshopt"
    if type(compressed) is not dict:
        raise FormatError("is no object", where=where)
    for key, least in (("buffer", 0), ("byteLength", 1), ("byteStride", 1), ("count", 1)):
        if type(compressed.get(key)) is not int or compressed[key] < least:
            raise FormatError(f"has no valid '{key}' ({compressed.get(key)!r})", where=where)
    if compressed["buffer"] >= len(buffers):
        raise FormatError(f"buffer is {compressed['buffer']}, but there are {len(buffers)} buffers", where=where)
    if type(compressed.get("byteOffset", 0)) is not int or compressed.get("byteOffset", 0) < 0:
        raise FormatError(f"byteOffset is {compressed['byteOffset']!r}", where=where)
    _check_range(compressed, compressed["byteLength"], buffers[compressed["buffer"]]["byteLength"])
    # Equal elements shrink by about 1000 : 1 at best (a block of 256 bytes to two bits); a higher count is false.
    if compressed["count"] * compressed["byteStride"] > 4096 * (compressed["byteLength"] + 256):
        raise FormatError(
            f"claims {compressed['count']} elements in {compressed['byteLength']} bytes (not possible)", where=where
        )


def _check_range(place: Json, length: int, available: int) -> None:
    offset = place.get("byteOffset", 0)
    if offset + length > available:
        raise FormatError(f"ends at byte {offset + length} of its buffer, which has {available}")


def _check_accessor(accessor: Json, views: list[Json]) -> None:
    kind, component_type, count = accessor["type"], accessor["componentType"], accessor["count"]
    if kind not in COMPONENTS:
        return  # the schema allows other types; readers of the data reject them
    size = element_size(component_type, kind)
    if "bufferView" in accessor:
        view = views[accessor["bufferView"]]
        _check_aligned(accessor, view)
        stride = view.get("byteStride", size)
        if stride < size:
            raise FormatError(f"element has {size} bytes, but its view's byteStride is {stride}")
        _check_inside(accessor.get("byteOffset", 0), stride * (count - 1) + size, view)
    elif accessor.get("byteOffset"):
        raise FormatError("has a byteOffset but no bufferView", where="byteOffset")
    elif count * COMPONENTS[kind][0] * COMPONENTS[kind][1] > MAX_ZERO_FILLED_COMPONENTS:
        raise UnsupportedError(f"claims {count} elements without any data (limit {MAX_ZERO_FILLED_COMPONENTS} numbers)")
    if "sparse" in accessor:
        _check_sparse(accessor["sparse"], size, count, views)


@cache
def _alignment(component_type: int, kind: str) -> int:
    unit = COMPONENT_SIZES[component_type]
    return max(unit, 4) if kind in ("MAT2", "MAT3", "MAT4") else unit


def _check_aligned(accessor: Json, view: Json) -> None:
    unit = _alignment(accessor["componentType"], accessor["type"])
    offset = accessor.get("byteOffset", 0)
    if offset % unit:
        raise FormatError(f"is {offset} (expected a multiple of {unit})", where="byteOffset")
    total = offset + view.get("byteOffset", 0)
    if total % unit:
        raise FormatError(f"starts at byte {total} of the buffer (expected a multiple of {unit})", where="byteOffset")


def _check_inside(offset: int, length: int, view: Json) -> None:
    if offset + length > view["byteLength"]:
        raise FormatError(f"ends at byte {offset + length} of its bufferView, which has {view['byteLength']}")


def _check_sparse(sparse: Json, size: int, count: int, views: list[Json]) -> None:
    if sparse["count"] > count:
        raise FormatError(f"is {sparse['count']} (expected at most the accessor's {count})", where="sparse.count")
    lengths = {"indices": COMPONENT_SIZES[sparse["indices"]["componentType"]], "values": size}
    for key, length in lengths.items():
        part = sparse[key]
        view = views[part["bufferView"]]
        try:
            if "byteStride" in view:
                raise FormatError("lies in a view with byteStride")
            _check_inside(part.get("byteOffset", 0), length * sparse["count"], view)
        except FormatError as error:
            raise error.at(f"sparse.{key}", ".") from None
