"""Quantization of key values: int16 or float32 in core glTF, filters under meshopt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import TypeAlias

import numpy as np

from anim.arrays import Bools, Floats
from anim.gltf.meshopt import codec, storage
from anim.model.track import NUM_COMPONENTS
from anim.optimization.options import Objective, Packing

MAX_INT16 = 32767.0
MAX_FLOAT32_KEYS = 2  # up to here float32 is no larger than int16 with its longer JSON
MIN_INT16_ERROR = 2.5e-5  # quaternion units; tolerance from which int16 is used
MIN_FILTER_ERROR = 4e-5  # the same for meshopt's quaternion filter, whose output is int16 too
FILTER_BIT_RANGE = (5, 16)
FILTER_ERROR_STEPS = (
    2.45 / 4
)  # error of that filter times its largest integer: √3 components by half a step, and √2 / 2
EXPONENT_ERROR_STEPS = 1.5 / 2  # error of meshopt's exponential filter, in its powers of two
MIN_EXPONENT = -40  # of that filter, for tolerance 0
MAX_EXPONENT = 1024  # above the power of two of any float64
MANTISSA_BITS = 22  # of meshopt's exponential filter, without the sign


Form: TypeAlias = tuple[str, int]  # EncodedKeys.form, and its bits per component or power of two


@dataclass(frozen=True, slots=True)
class ByteCosts:
    """Bytes of JSON in a search's size estimate.

    track: for a track with an output of its own: channel, sampler and accessor. repeated: for one with the keys of
    another: its channel. single_key: for a track with a single key, whose accessor others may share. axis: for the
    accessor of a time axis.
    """

    track: float
    repeated: float
    single_key: float
    axis: float


# Mean lengths in minified JSON; after gzip they are a tenth of that (measured on Fox, Robot and Knight).
BYTE_COSTS = {Objective.FILE: ByteCosts(175, 56, 95, 120), Objective.GZIP: ByteCosts(18, 6, 14, 14)}


@dataclass(frozen=True, slots=True)
class Encoding:
    """Storage of keys, and its cost."""

    packing: Packing
    byte_costs: ByteCosts

    @property
    def time_bytes(self) -> float:
        """Bytes of one key time."""
        return 4.0 if self.packing is Packing.CORE else 2.5

    def key_bytes(self, path: str) -> float:
        """Return the bytes of one key's value."""
        if self.packing is Packing.CORE:
            return 8.0 if path == "rotation" else 12.0
        return 4.5

    def size(self, keys: Sequence[EncodedKeys]) -> float:
        """Return the bytes of the keys of several tracks."""
        if self.packing is not Packing.CORE:
            streams: dict[tuple[str, int], list[EncodedKeys]] = {}
            for each in keys:
                streams.setdefault((each.form, each.values.shape[1]), []).append(each)
            return compressed_size(list(streams.values()), self.packing)
        return sum(each.values.size * (2 if each.form == "int16" else 4) for each in keys)

    def min_size(self, count: int, path: str, tolerance: float) -> float:
        """Return the bytes that a number of keys takes at least, with an error up to `tolerance` in their units."""
        if self.packing is not Packing.CORE:
            return 0.0
        return count * (4 * 2 if is_int16(path, tolerance, count) else 4 * NUM_COMPONENTS[path])


@dataclass(frozen=True, slots=True)
class EncodedKeys:
    """Keys as stored.

    values: (K, C) as they decode. form: "int16", "float32", "quaternion" or "exponent", the last two meshopt's
    filters. codes: their filtered bytes, 8 per key or 4 per component. error: largest error of the filter, in units of
    the values.
    """

    values: Floats
    form: str
    codes: bytes = b""
    error: float = 0.0

    @property
    def name(self) -> bytes:
        """Bytes that are equal for tracks with equal storage."""
        return self.codes or self.values.tobytes()

    def select_keys(self, keep: Bools) -> EncodedKeys:
        """Return the keys of a mask (K,)."""
        rows = np.frombuffer(self.codes, np.uint8).reshape(len(keep), -1)[keep]
        return replace(self, values=self.values[keep], codes=rows.tobytes())

    def exact(self) -> Floats:
        """Return the values as meshopt decodes them: its filter computes in float32, unlike the search."""
        if self.form != "quaternion":
            return self.values
        return storage.decompress_document(storage.FilteredValues("QUATERNION", self.codes), 4)


def choose_format(values: Floats, path: str, tolerance: float, packing: Packing) -> Form:
    """Return the smallest format for keys (K, C) with an error up to about `tolerance`, in their units."""
    if packing is Packing.CORE:
        return ("int16", 0) if is_int16(path, tolerance, len(values)) else ("float32", 0)
    if path == "rotation" and tolerance >= MIN_FILTER_ERROR:
        return "quaternion", filter_bits(tolerance)
    return "exponent", exponent(values, tolerance)


def storage_level(path: str, tolerance: float, packing: Packing) -> int:
    """Return a number that is equal for tolerances with which `choose_format` chooses equally for any keys."""
    if packing is Packing.CORE:
        return int(tolerance >= MIN_INT16_ERROR)
    if path == "rotation" and tolerance >= MIN_FILTER_ERROR:
        return MAX_EXPONENT + filter_bits(tolerance)
    return _tolerated_exponent(tolerance)


def is_int16(path: str, tolerance: float, count: int) -> bool:
    """Return whether a number of keys is stored as int16 in core glTF."""
    return path == "rotation" and tolerance >= MIN_INT16_ERROR and count > MAX_FLOAT32_KEYS


def encode(values: Floats, form: Form) -> EncodedKeys:
    """Return keys (K, C) in a format."""
    kind, number = form
    if kind == "int16":
        return EncodedKeys(np.rint(values * MAX_INT16) / MAX_INT16, kind)
    if kind == "float32":
        return EncodedKeys(values.astype(np.float32).astype(np.float64), kind)
    if kind == "quaternion":
        return encode_all([values], [form])[0]
    mantissa = np.rint(values * 2.0**-number)
    return EncodedKeys(
        mantissa * 2.0**number, kind, _exponent_codes(mantissa, number), EXPONENT_ERROR_STEPS * 2.0**number
    )


def encode_all(values: Sequence[Floats], forms: Sequence[Form]) -> list[EncodedKeys]:
    """Return the keys (K, C) of each track in its format; all quaternions are decoded in one call."""
    filtered = [i for i, (kind, _) in enumerate(forms) if kind == "quaternion"]
    if not filtered:
        return [encode(keys, form) for keys, form in zip(values, forms, strict=True)]
    codes = [_quaternion_codes(values[i], forms[i][1]) for i in filtered]
    decoded = np.split(_decode_quaternions(b"".join(codes)), np.cumsum([len(each) // 8 for each in codes])[:-1])
    tolerances = [FILTER_ERROR_STEPS / ((1 << (forms[i][1] - 1)) - 1) for i in filtered]
    found = dict(zip(filtered, map(EncodedKeys, decoded, repeat("quaternion"), codes, tolerances), strict=True))
    return [found[i] if i in found else encode(values[i], forms[i]) for i in range(len(forms))]


def encode_stack(
    keys: Floats, counts: Sequence[int], paths: Sequence[str], tolerances: Sequence[float], packing: Packing
) -> tuple[list[EncodedKeys], Floats]:
    """Return the keys of each track, and their values (C, T, K), in the smallest formats within the tolerances.

    keys: (C, T, K), component, track and key. counts: (T,) of each track's keys. paths, tolerances: (T,), as of
    `choose_format`.
    """
    if packing is not Packing.CORE:
        values = [keys[:, t, :count].T for t, count in enumerate(counts)]
        forms = [choose_format(*each, packing) for each in zip(values, paths, tolerances, strict=True)]
        stored = encode_all(values, forms)
        decoded = keys.copy()
        for t, (count, each) in enumerate(zip(counts, stored, strict=True)):
            decoded[:, t, :count] = each.values.T
            decoded[:, t, count:] = each.values[-1, :, None]
        return stored, decoded
    integers = [is_int16(*each) for each in zip(paths, tolerances, counts, strict=True)]
    decoded = keys.astype(np.float32).astype(np.float64)
    some = np.flatnonzero(integers)
    decoded[:, some] = np.rint(keys[:, some] * MAX_INT16) / MAX_INT16
    by_track = np.ascontiguousarray(np.moveaxis(decoded, 0, 2))
    names = ["int16" if each else "float32" for each in integers]
    # copies: keys of few tracks are kept for long, and would keep those of all
    stored = [EncodedKeys(by_track[t, : counts[t]].copy(), name) for t, name in enumerate(names)]
    return stored, decoded


def constant_cost(value: Floats) -> EncodedKeys:
    """Return a single key (1, C) at `value` (C,), in float32, whose JSON is shorter than that of integers."""
    return EncodedKeys(value[None].astype(np.float32).astype(np.float64), "float32")


def filter_bits(tolerance: float) -> int:
    """Return the bits per component for an error of the quaternion filter up to `tolerance`."""
    return min(
        max(math.ceil(1 + math.log2(1 + FILTER_ERROR_STEPS / tolerance)), FILTER_BIT_RANGE[0]), FILTER_BIT_RANGE[1]
    )


def exponent(values: Floats, tolerance: float) -> int:
    """Return the power of two for rounding errors up to `tolerance`, within a mantissa of 23 bits."""
    wanted = _tolerated_exponent(tolerance)
    largest = float(np.abs(values).max(initial=1e-9)) or 1e-9
    return max(wanted, math.ceil(math.log2(largest)) - MANTISSA_BITS)


def _tolerated_exponent(tolerance: float) -> int:
    """The largest power of two for rounding errors up to `tolerance`."""
    return math.floor(math.log2(tolerance / EXPONENT_ERROR_STEPS)) if tolerance > 0 else MIN_EXPONENT


def compressed_size(streams: Sequence[Sequence[EncodedKeys]], packing: Packing) -> int:
    """Return the bytes of keys under meshopt's codec, one stream per list."""
    from meshopt import encode_gltf_buffer

    total = 0
    for keys in streams:
        stride = 8 if keys[0].form == "quaternion" else codec.row_size(4 * keys[0].values.shape[1], 4)
        rows = np.frombuffer(b"".join(each.codes for each in keys), np.uint8).reshape(-1, stride)
        total += len(encode_gltf_buffer(rows, "ATTRIBUTES", 1 if packing is Packing.KHR else 0))
    return total


def _quaternion_codes(values: Floats, bits: int) -> bytes:
    """Rows of 8 bytes: the smallest three components of unit quaternions (K, 4)."""
    from meshopt import encode_filter_quat

    return bytes(np.ascontiguousarray(encode_filter_quat(values.astype(np.float32), 8, bits)).view(np.uint8))


def _decode_quaternions(codes: bytes) -> Floats:
    """Unit quaternions (K, 4) as the filter decodes them: through int16, so not exactly unit."""
    rows = np.frombuffer(codes, "<i2").reshape(-1, 4).astype(np.int64)
    three = rows[:, :3] * (1 / math.sqrt(2) / (rows[:, 3] | 3))[:, None]
    largest = rows[:, 3] & 3
    every = np.arange(len(rows))
    result = np.empty((len(rows), 4))
    result[every, largest] = np.sqrt(np.maximum(0, 1 - (three * three).sum(axis=1)))
    for k in range(3):
        result[every, (largest + 1 + k) % 4] = three[:, k]
    return np.asarray(np.rint(result * MAX_INT16) / MAX_INT16)


def _exponent_codes(mantissa: Floats, power: int) -> bytes:
    """4 bytes per component: a mantissa of 24 bits under one exponent."""
    whole = mantissa.astype(np.int64)
    return ((whole & 0xFFFFFF) | ((power & 255) << 24)).astype("<u4").tobytes()
