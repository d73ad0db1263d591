"""Read accessors of every component type, stride and compression, normalized or sparse."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from functools import cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints, freeze, is_finite
from anim.errors import AnimError, FormatError, UnsupportedError
from anim.gltf.document import Buffer, Bytes, Document, Json, json_array
from anim.gltf.reading.overlaps import unbacked_bytes
from anim.gltf.validation import buffer_layout
from anim.memory import MemoryBudget

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
FLOAT = 5126
FLOAT_VECTORS = {(FLOAT, "SCALAR"): 1, (FLOAT, "VEC2"): 2, (FLOAT, "VEC3"): 3, (FLOAT, "VEC4"): 4}  # components
BYTES_PER_UNBACKED_BYTE = 32  # of memory; work on as many keys takes seconds
T = TypeVar("T")


class Accessors:
    """Accessors of one document; each view is opened, and decompressed, once."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._accessors = json_array(document.json, "accessors")
        self._views = json_array(document.json, "bufferViews")
        self._bytes: dict[int, Bytes] = {}
        self._given: Mapping[int, NDArray[Any]] = {}
        self.budget = MemoryBudget(_stored_bytes(document))

    def over(self, given: Mapping[int, NDArray[Any]]) -> Accessors:
        """Return accessors with replaced values (count, components), by accessor index."""
        other = copy(self)
        other._given = {**self._given, **given}
        return other

    def check_total(self, indices: Iterable[int]) -> int:
        """Return the bytes of these accessors as float64, each once.

        Raises UnsupportedError if they would take more memory than the limit allows.
        """
        chosen = {index for index in indices if index not in self._given}
        described = [self._accessors[i] for i in chosen]
        total: int = 8 * sum([about["count"] * _components(about["type"]) for about in described])
        views = {about["bufferView"] for about in described if "bufferView" in about} - self._bytes.keys()
        extended = [view for view in map(self._views.__getitem__, views) if "extensions" in view]
        packed = filter(None, map(buffer_layout.compression, extended))
        self.budget.check(total + sum(each["count"] * each["byteStride"] for each in packed))
        return total

    def check_keys(self, indices: Iterable[int]) -> None:
        """Raise UnsupportedError as `check_total`, and if keys that no bytes of their own back would take too much.

        Those are of accessors that overlap, or have no data: they count with the copies that commands work on. Files
        that tools export have none, and their keys are as many as their bytes.
        """
        chosen = set(indices) - self._given.keys()
        if self.budget.is_within(BYTES_PER_UNBACKED_BYTE * self.check_total(chosen)):
            return
        described = [self._accessors[i] for i in chosen]
        self.budget.check(
            BYTES_PER_UNBACKED_BYTE * unbacked_bytes(described, self._views, self._document.buffers),
            "keys of accessors that overlap, or have no data,",
        )

    def about(self, index: int) -> Json:
        """Return the JSON of an accessor."""
        return self._accessors[index]

    def raw(self, index: int) -> NDArray[Any]:
        """Return the stored values (count, components) in their own type, column-major; read-only.

        Sparse values are applied, accessors without data are zeros. Raises FormatError, UnsupportedError.
        """
        return self._located(index, self._raw)

    def floats(self, index: int) -> Floats:
        """Return the values (count, components) as float64, normalized integers as fractions.

        Normalized integers: glTF 2.0, 3.11. Raises FormatError for NaN or infinity.
        """
        with np.errstate(invalid="ignore"):  # a signaling NaN is rejected below
            values = self._located(index, self._floats)
        if not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0][0])
            raise FormatError(f"holds NaN or infinity (element {row})", where=f"accessor {index}")
        return values

    def unchecked(self, index: int) -> Floats:
        """Return `floats` without the NaN check, for callers with validating types.

        numpy warns of a signaling NaN; callers that read many accessors disable that warning once, which takes time.
        """
        return self._located(index, self._floats)

    def plain_floats(self, indices: Iterable[int]) -> dict[int, Floats]:
        """Return all numbers, (count × components,), of those accessors that are uncompressed float32 vectors.

        Decoded in one call: parts of one read-only array. Without the others, and empty if a number is not finite.
        """
        words: dict[int, NDArray[Any]] = {}  # of buffers, as float32
        runs: list[list[int]] = []  # accessors next to each other: buffer, first word, and the one after the last
        places, size = [], 0
        for index in dict.fromkeys(indices):
            about = self._accessors[index]
            rows = FLOAT_VECTORS.get((about["componentType"], about["type"]))
            if rows is None or "bufferView" not in about or "sparse" in about or index in self._given:
                continue
            view = self._views[about["bufferView"]]
            if "extensions" in view or view.get("byteStride", 4 * rows) != 4 * rows:
                continue
            number, length = view["buffer"], about["count"] * rows
            if number not in words:
                words[number] = _float_words(self._document.buffers[number])
            first, odd = divmod(view.get("byteOffset", 0) + about.get("byteOffset", 0), 4)
            if odd or first + length > len(words[number]):
                continue
            if runs and runs[-1][0] == number and runs[-1][2] == first:
                runs[-1][2] += length
            else:
                runs.append([number, first, first + length])
            places.append((index, size, size := size + length))
        self.budget.add(8 * size)
        parts = [words[number][first:end] for number, first, end in runs]
        joined = freeze(np.concatenate(parts, dtype=np.float64)) if parts else np.zeros(0)
        if not is_finite(joined):
            return {}
        return {index: joined[start:end] for index, start, end in places}

    def integers(self, index: int) -> Ints:
        """Return the values (count, components) as int64. Raises FormatError for floats."""
        raw = self.raw(index)
        if raw.dtype.kind == "f":
            raise FormatError("holds floats (expected integers)", where=f"accessor {index}")
        self.budget.add(8 * raw.size)
        return raw.astype(np.int64)

    def indices(self, index: int) -> Ints:
        """Return `integers`. Raises FormatError for signed types, which are invalid as indices."""
        if self.raw(index).dtype.kind == "i":
            raise FormatError("holds signed integers (expected unsigned ones)", where=f"accessor {index}")
        return self.integers(index)

    def matrices(self, index: int) -> Floats:
        """Return MAT4 as (count, 4, 4) for column vectors.

        glTF's column-major order is transposed here only.
        """
        return self.floats(index).reshape(-1, 4, 4).transpose(0, 2, 1)

    def _located(self, index: int, read: Callable[[int], T]) -> T:
        try:
            return read(index)
        except AnimError as error:
            raise error.at(f"accessor {index}") from None

    def _raw(self, index: int) -> NDArray[Any]:
        if index in self._given:
            return self._given[index]
        about = self._accessors[index]
        form = _element_layout(about["componentType"], about["type"])
        if "bufferView" in about:
            number = about["bufferView"]
            stride = self._views[number].get("byteStride", form.columns * form.column)
            base = _strided(self.view(number), about.get("byteOffset", 0), about["count"], stride, form)
        else:
            base = np.broadcast_to(np.zeros((), form.dtype), (about["count"], form.columns * form.rows))
        return self._with_sparse(base, about, form) if "sparse" in about else base

    def _with_sparse(self, base: NDArray[Any], about: Json, form: ElementLayout) -> NDArray[Any]:
        sparse = about["sparse"]
        count, where, values = sparse["count"], sparse["indices"], sparse["values"]
        whole = _element_layout(where["componentType"], "SCALAR")
        view = self.view(where["bufferView"])
        places = _strided(view, where.get("byteOffset", 0), count, whole.column, whole)[:, 0].astype(np.int64)
        if places[-1] >= about["count"] or (np.diff(places) <= 0).any():
            raise FormatError("sparse indices are not increasing, or beyond its count")
        view = self.view(values["bufferView"])
        self.budget.add(base.size * base.itemsize)
        full = base.copy()
        full[places] = _strided(view, values.get("byteOffset", 0), count, form.columns * form.column, form)
        full.flags.writeable = False
        return full

    def _floats(self, index: int) -> Floats:
        raw = self._raw(index)
        self.budget.add(8 * raw.size)
        values = raw.astype(np.float64)
        if raw.dtype.kind != "f" and self._accessors[index].get("normalized"):
            return denormalized(values, raw.dtype)
        return values

    def view(self, number: int) -> Bytes:
        """Return the decompressed bytes of a buffer view. Raises FormatError, UnsupportedError."""
        found = self._bytes.get(number)
        if found is None:
            found = self._bytes[number] = self._opened(number)
        return found

    def _opened(self, number: int) -> Bytes:
        view = self._views[number]
        try:
            if "extensions" not in view:
                return _slice(self._document.buffers[view["buffer"]].data, view)
            compressed = buffer_layout.compression(view)
            if compressed is not None:
                stored = _slice(self._document.buffers[compressed["buffer"]].data, compressed)
                from anim.gltf.meshopt import codec

                self.budget.add(compressed["count"] * compressed["byteStride"])
                plain = codec.decode(stored, compressed)
                if len(plain) < view["byteLength"]:
                    raise FormatError(f"decodes to {len(plain)} bytes (expected {view['byteLength']})")
                return plain
            if view["extensions"] and not self._document.buffers[view["buffer"]].has_data:
                names = ", ".join(view["extensions"])
                raise UnsupportedError(f"its data is hidden by {names}, which is not handled")
            return _slice(self._document.buffers[view["buffer"]].data, view)
        except AnimError as error:
            raise error.at(f"bufferView {number}") from None


def _stored_bytes(document: Document) -> int:
    """Bytes of all buffers with data, a file that several use counted once."""
    sizes = {each.uri or str(i): each.byte_length for i, each in enumerate(document.buffers) if each.has_data}
    return sum(sizes.values())


@cache
def _components(kind: str) -> int:
    columns, rows = buffer_layout.COMPONENTS.get(kind, (0, 0))
    return columns * rows


def denormalized(values: Floats, dtype: np.dtype[Any]) -> Floats:
    """Return normalized integers as fractions: c / max, signed ones clamped at −1."""
    scaled = values / float(np.iinfo(dtype).max)
    return np.maximum(scaled, -1.0) if dtype.kind == "i" else scaled


def _float_words(buffer: Buffer) -> NDArray[Any]:
    """The whole words of a buffer as float32; (0,) if it can't be read."""
    try:
        data = buffer.data
    except AnimError:
        return np.zeros(0, np.float32)
    return data[: len(data) // 4 * 4].view("<f4")


def _slice(data: Bytes, place: Json) -> Bytes:
    start = place.get("byteOffset", 0)
    return data[start : start + place["byteLength"]]


class ElementLayout(NamedTuple):
    """Memory layout of one element: columns of `rows` values, `column` bytes per column."""

    dtype: np.dtype[Any]
    columns: int
    rows: int
    column: int


@cache
def _element_layout(component_type: int, kind: str) -> ElementLayout:
    if kind not in buffer_layout.COMPONENTS:
        raise FormatError(f"has type '{kind}' (expected one of {', '.join(buffer_layout.COMPONENTS)})")
    return ElementLayout(np.dtype(DTYPES[component_type]), *buffer_layout.element(component_type, kind))


def _strided(view: Bytes, offset: int, count: int, stride: int, form: ElementLayout) -> NDArray[Any]:
    """Elements (count, columns × rows) as a view into the bytes; `stride` in bytes per element."""
    size = form.dtype.itemsize
    if form.columns == 1:
        array: NDArray[Any] = np.ndarray((count, form.rows), form.dtype, view, offset, (stride, size))
        return array
    shape = (count, form.columns, form.rows)
    array = np.ndarray(shape, form.dtype, view, offset, (stride, form.column, size))
    return array.reshape(count, form.columns * form.rows)
