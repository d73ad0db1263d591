"""Files that are longer than what is read of them: sparse ones cost nobody anything."""

from __future__ import annotations

import json
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest

from anim.gltf.io import images
from anim.gltf.io.source import open_file

LONG_BYTES = 300_000_000
MOST_BYTES = 60_000_000  # of memory; a copy is made by blocks of 17 MB
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A .gltf with two buffers in one long file, and a long image."""
    buffers = [{"uri": "a.bin", "byteLength": length} for length in (1000, 40_000)]
    scene = {"asset": {"version": "2.0"}, "buffers": buffers, "images": [{"uri": "a.png"}]}
    (tmp_path / "a.gltf").write_text(json.dumps(scene))
    (tmp_path / "a.bin").write_bytes(bytes(range(250)) * 160)
    (tmp_path / "a.png").write_bytes(PNG)
    for name in ("a.bin", "a.png"):
        with (tmp_path / name).open("r+b") as file:
            file.truncate(LONG_BYTES)
    return tmp_path / "a.gltf"


def peak(job: Callable[[], object]) -> int:
    """Return the largest size of new memory of a job, in bytes."""
    tracemalloc.start()
    try:
        job()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_buffer_is_read_as_far_as_the_document_says(scene: Path) -> None:
    assert peak(lambda: open_file(str(scene))) < MOST_BYTES
    first, second = open_file(str(scene)).document.buffers
    assert second.data.tobytes() == bytes(range(250)) * 160
    assert first.data.tobytes() == second.data.tobytes()[:1000]


def test_a_copied_image_is_read_in_blocks(scene: Path, tmp_path: Path) -> None:
    document = open_file(str(scene)).document
    (tmp_path / "out").mkdir()
    assert peak(lambda: images.copy_images(document, tmp_path, tmp_path / "out")) < MOST_BYTES
    _, copies = images.copy_images(document, tmp_path, tmp_path / "out")
    with (tmp_path / "a.png").open("r+b") as file:
        file.truncate(2 * MOST_BYTES)
    assert peak(lambda: images.write_copies(copies)) < MOST_BYTES
    assert (tmp_path / "out" / "a.png").stat().st_size == 2 * MOST_BYTES
