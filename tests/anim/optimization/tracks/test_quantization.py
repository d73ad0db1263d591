"""How keys are stored, by meshopt's own decoder and by arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from anim.gltf.meshopt import codec
from anim.gltf.meshopt.storage import FilteredValues, decompress_document, decompressed_bytes
from anim.optimization.options import Objective, Packing
from anim.optimization.tracks import quantization
from anim.optimization.tracks.quantization import BYTE_COSTS, EncodedKeys, Encoding

RNG = np.random.default_rng(23)
TURNS = Rotation.random(200, np.random.default_rng(4)).as_quat()
VECTORS = np.cumsum(RNG.normal(size=(200, 3)), axis=0)


def _coding(packing: Packing) -> Encoding:
    return Encoding(packing, BYTE_COSTS[Objective.FILE])


def test_int16_is_the_nearest_integer() -> None:
    stored = quantization.encode(TURNS, ("int16", 0))
    integers = stored.values * 32767
    assert integers == pytest.approx(np.round(integers), abs=1e-9)
    assert np.abs(integers - TURNS * 32767).max() <= 0.5 + 1e-9


def test_float32_is_what_a_file_holds() -> None:
    stored = quantization.encode(VECTORS, ("float32", 0))
    assert (stored.values == VECTORS.astype("<f4")).all()
    assert quantization.constant_cost(VECTORS[0]).values.tolist() == [VECTORS[0].astype("<f4").tolist()]


@pytest.mark.parametrize("bits", [5, 9, 12, 16])
def test_quaternions_as_meshopt_decodes_them(bits: int) -> None:
    stored = quantization.encode(TURNS, ("quaternion", bits))
    exact = decompress_document(FilteredValues("QUATERNION", stored.codes), 4)
    assert (stored.exact() == exact).all()
    assert np.abs(stored.values - exact).max() <= 1 / 32767 + 1e-12  # float32 inside the decoder: a step at most
    turned = (Rotation.from_quat(exact) * Rotation.from_quat(TURNS).inv()).magnitude()
    assert turned.max() < 4 * 2.0 ** -(bits - 1)


@pytest.mark.parametrize("miss", [4e-5, 2e-4, 1e-3, 1e-2])
def test_filter_bits_keep_what_storing_may_miss(miss: float) -> None:
    stored = quantization.encode(TURNS, quantization.choose_format(TURNS, "rotation", miss, Packing.EXT))
    off = stored.exact() * np.sign((stored.exact() * TURNS).sum(axis=1))[:, None] - TURNS
    assert np.linalg.norm(off, axis=1).max() <= 1.5 * miss
    fewer = quantization.filter_bits(miss) - 2
    if fewer >= 5:  # and not by wasting bits
        coarse = quantization.encode(TURNS, ("quaternion", fewer)).exact()
        off = coarse * np.sign((coarse * TURNS).sum(axis=1))[:, None] - TURNS
        assert np.linalg.norm(off, axis=1).max() > miss


@given(st.floats(1e-9, 1.0), st.floats(1e-4, 1e4))
def test_exponents_as_meshopt_decodes_them(miss: float, size: float) -> None:
    values = size * VECTORS / np.abs(VECTORS).max()
    number = quantization.exponent(values, miss)
    stored = quantization.encode(values, ("exponent", number))
    assert (decompress_document(FilteredValues("EXPONENTIAL", stored.codes), 3) == stored.values).all()
    finest = 2.0 ** np.ceil(np.log2(size)) / 2**22  # what a mantissa of 23 bits can tell apart
    assert np.abs(stored.values - values).max() <= max(miss, finest)


def test_exponents_without_any_allowance_or_size() -> None:
    for values in (np.zeros((2, 3)), np.full((2, 3), 1e-30), VECTORS):
        stored = quantization.encode(values, ("exponent", quantization.exponent(values, 0.0)))
        assert (decompress_document(FilteredValues("EXPONENTIAL", stored.codes), 3) == stored.values).all()
        assert np.abs(stored.values - values).max() <= 1e-6 * max(1.0, np.abs(values).max())


@pytest.mark.parametrize(
    ("path", "keys", "miss", "expected"),
    [
        ("rotation", 10, 1e-3, "int16"),
        ("rotation", 10, 1e-6, "float32"),
        ("rotation", 2, 1e-3, "float32"),  # "normalized":true is longer than what two keys save
        ("translation", 10, 1e-3, "float32"),
        ("scale", 10, 1e-3, "float32"),
    ],
)
def test_core_forms(path: str, keys: int, miss: float, expected: str) -> None:
    assert quantization.choose_format(TURNS[:keys], path, miss, Packing.CORE)[0] == expected


@pytest.mark.parametrize(
    ("path", "miss", "expected"),
    [("rotation", 1e-3, "quaternion"), ("rotation", 1e-6, "exponent"), ("translation", 1e-3, "exponent")],
)
def test_compressed_forms(path: str, miss: float, expected: str) -> None:
    for packing in (Packing.EXT, Packing.KHR):
        assert quantization.choose_format(TURNS, path, miss, packing)[0] == expected


@pytest.mark.parametrize("packing", Packing)
@pytest.mark.parametrize("path", ["rotation", "translation"])
def test_equal_storage_levels_are_equal_forms(path: str, packing: Packing) -> None:
    tolerances = [0.0, *np.geomspace(1e-12, 1e3, 400).tolist()]
    levels = [quantization.storage_level(path, each, packing) for each in tolerances]
    forms: dict[int, set[quantization.Form]] = {}
    for scale in (1e-3, 1, 1e3):
        for level, tolerance in zip(levels, tolerances, strict=True):
            forms.setdefault(level, set()).add(quantization.choose_format(scale * VECTORS, path, tolerance, packing))
        assert all(len(each) == 1 for each in forms.values())
        forms.clear()
    assert len(set(levels)) < 80


def test_sizes_of_core_are_plain() -> None:
    parts = [quantization.encode(TURNS[:5], ("int16", 0)), quantization.encode(VECTORS[:7], ("float32", 0))]
    assert _coding(Packing.CORE).size(parts) == 5 * 8 + 7 * 12


@pytest.mark.parametrize(
    ("packing", "name"), [(Packing.EXT, "EXT_meshopt_compression"), (Packing.KHR, "KHR_meshopt_compression")]
)
def test_sizes_of_codecs_are_those_of_streams(packing: Packing, name: str) -> None:
    """One stream for each form and number of components, encoded as `anim.gltf` encodes what it writes."""
    turns = [quantization.encode(TURNS[a : a + 50], ("quaternion", 10)) for a in (0, 50)]
    moves = [quantization.encode(VECTORS[:40], ("exponent", -9))]
    weights = [quantization.encode(VECTORS[:40, :1], ("exponent", -9))]
    expected = 0
    for stream, stride in ((turns, 8), (moves, 12), (weights, 4)):
        rows = np.frombuffer(b"".join(each.codes for each in stream), np.uint8).reshape(-1, stride)
        expected += len(codec.encode(rows, name))
    assert _coding(packing).size([turns[0], *moves, *weights, turns[1]]) == expected


@pytest.mark.parametrize(("count", "row"), [(64, 256), (65, 4), (128, 4)])
@pytest.mark.parametrize("packing", [Packing.EXT, Packing.KHR])
def test_rows_of_many_weights_are_split(packing: Packing, count: int, row: int) -> None:
    """The codec takes rows of up to 256 bytes; longer keys go element by element, as `anim.gltf` writes them."""
    keys = quantization.encode(np.cumsum(RNG.normal(size=(30, count)), axis=0), ("exponent", -9))
    rows = np.frombuffer(keys.codes, np.uint8).reshape(-1, row)
    assert _coding(packing).size([keys]) == len(codec.encode(rows, f"{packing.name}_meshopt_compression"))


def test_codes_decode_to_as_many_bytes() -> None:
    stored = quantization.encode(TURNS, ("quaternion", 12))
    assert len(stored.codes) == len(decompressed_bytes(FilteredValues("QUATERNION", stored.codes))) == 8 * 200


def test_prices_are_lower_after_gzip() -> None:
    file, packed = BYTE_COSTS[Objective.FILE], BYTE_COSTS[Objective.GZIP]
    assert (file.track > packed.track, file.single_key > packed.single_key, file.axis > packed.axis) == (
        True,
        True,
        True,
    )
    assert EncodedKeys(TURNS, "as it is").exact() is TURNS
