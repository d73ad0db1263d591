"""Pipes, which have no length: read as far as the memory limit, or as a GLB's header says."""

from __future__ import annotations

import os

import pytest

from anim.errors import UnsupportedError
from anim.files.resolver import read_gltf
from anim.memory import memory_limit

LIMIT = 1000  # bytes


def piped(content: bytes) -> bytes:
    """What is read of a pipe with this content."""
    source, target = os.pipe()
    with os.fdopen(target, "wb") as file:
        file.write(content)  # less than a pipe's buffer
    with os.fdopen(source, "rb") as file, memory_limit(LIMIT):
        return read_gltf(file)


def glb(stated: int, size: int) -> bytes:
    return (b"glTF\2\0\0\0" + stated.to_bytes(4, "little")).ljust(size, b"\0")


@pytest.mark.parametrize("content", [b"{" + LIMIT * b" ", glb(LIMIT // 2, LIMIT + 1), glb(2 * LIMIT, 2 * LIMIT + 1)])
def test_a_pipe_beyond_the_limit_is_refused(content: bytes) -> None:
    with pytest.raises(UnsupportedError, match=r"is a pipe or device with more than"):
        piped(content)


@pytest.mark.parametrize("content", [b"", b"{}", b"{" + (LIMIT - 1) * b" ", glb(2 * LIMIT, 2 * LIMIT)])
def test_a_pipe_within_it_is_read(content: bytes) -> None:
    assert piped(content) == content
