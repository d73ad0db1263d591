"""Orders of contents within a compressed stream: all there, never larger than as they come, the same every time."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from anim.gltf.meshopt import codec, stream_order
from anim.gltf.validation.buffer_layout import MESHOPT

RNG = np.random.default_rng(7)


def _content(start: int, rows: int, stride: int = 8) -> bytes:
    """Elements that drift slowly away from a start of their own."""
    steps = RNG.integers(-1, 2, (rows, stride)).cumsum(axis=0)
    return (start + steps).astype(np.uint8).tobytes()


def _size(codes: list[bytes], order: list[int], extension: str, stride: int = 8) -> int:
    rows = np.frombuffer(b"".join(codes[i] for i in order), np.uint8).reshape(-1, stride)
    return len(codec.encode(rows, extension))


@pytest.mark.parametrize("extension", MESHOPT)
def test_neighbors_are_alike(extension: str) -> None:
    """Two kinds of contents that take turns: apart, they take fewer bytes."""
    codes = [_content(20 if i % 2 else 200, 9) for i in range(24)]
    order = stream_order.order_contents(codes, 8, extension)
    assert sorted(order) == list(range(24))
    changes = sum(a % 2 != b % 2 for a, b in pairwise(order))
    assert changes == 1
    assert _size(codes, order, extension) < 0.87 * _size(codes, list(range(24)), extension)
    assert stream_order.order_contents(codes, 8, extension) == order


@pytest.mark.parametrize("seed", range(5))
def test_never_larger_than_as_they_come(seed: int) -> None:
    rng = np.random.default_rng(seed)
    codes = [rng.integers(0, 256, (int(n), 4), np.uint8).tobytes() for n in rng.integers(1, 20, 12)]
    order = stream_order.order_contents(codes, 4, MESHOPT[0])
    assert sorted(order) == list(range(12))
    assert _size(codes, order, MESHOPT[0], 4) <= _size(codes, list(range(12)), MESHOPT[0], 4)


@pytest.mark.parametrize("count", [1, 2])
def test_few_contents(count: int) -> None:
    codes = [_content(90, 3) for _ in range(count)]
    assert sorted(stream_order.order_contents(codes, 8, MESHOPT[0])) == list(range(count))


def test_a_byte_costs_what_the_codec_takes_for_it() -> None:
    """256 elements whose one byte steps by the same amount each time, in whole bytes per element."""
    for step, price in ((0, 0.0), (1, 0.25), (-1, 0.25), (5, 0.5), (-7, 0.5), (60, 1.0)):
        rows = np.zeros((256, 4), np.uint8)
        rows[:, 0] = (np.arange(256) * step).astype(np.uint8)
        tail = len(codec.encode(np.zeros((256, 4), np.uint8), MESHOPT[0]))
        taken = (len(codec.encode(rows, MESHOPT[0])) - tail) / 256
        assert taken == pytest.approx(price, abs=0.02)
        ours = stream_order.PRICES[2 * step if step >= 0 else -2 * step - 1]
        assert price <= ours <= price + 0.31  # in the midst of others that are dearer, it is dearer too
