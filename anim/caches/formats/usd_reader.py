"""USD → VertexCache: all meshes of a stage, read by a child process."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from anim.arrays import Floats
from anim.caches import temporary_files
from anim.caches.child_process import ChildEndedError, run_in_child
from anim.caches.formats import usd_meshes
from anim.caches.formats.npz import parts_of
from anim.caches.options import ReadOptions
from anim.caches.storage import Inputs
from anim.errors import FormatError, UnsupportedError
from anim.memory import limit_for
from anim.model import FrameChunk, VertexCache

NEAR_LIMIT = 0.8  # of the limit of memory: allocations are of large blocks, the last of which fails


def read(inputs: Inputs, reading: ReadOptions, *, ending: str = ".usd") -> VertexCache:
    """Return all meshes of the stage in one cache, in metres, at every time code at which any of them moves.

    Meshes are skinned, transformed to world space and concatenated in the order of the stage; polygons become
    triangles. ending: ".usdz" for a package. Raises UnsupportedError without usd-core and for a PointInstancer,
    FormatError without meshes.
    """
    with _run(inputs, ending, usd_meshes.summary) as summaries:
        stage: usd_meshes.StageSummary = next(summaries)
    rate = reading.input_fps or stage.rate
    parts = parts_of(stage.kept)
    return VertexCache(
        stage.codes / rate - min(stage.codes[0] / rate, 0.0),
        stage.vertices,
        stage.faces,
        lambda: _chunks(inputs, ending, stage.codes, stage.has_normals, stage.handedness is not None),
        rest=stage.rest,
        has_normals=stage.has_normals,
        parts=parts if parts and parts[-1].vertices[1] == stage.vertices else (),
        up=stage.up,
        handedness=stage.handedness,
    )


def _chunks(inputs: Inputs, ending: str, codes: Floats, normals: bool, tangents: bool) -> Iterator[FrameChunk]:
    frames = partial(usd_meshes.frames, codes=codes, normals=normals, tangents=tangents)
    with _run(inputs, ending, frames) as chunks:
        yield from chunks


@contextmanager
def _run(inputs: Inputs, ending: str, function: Callable[[str, int], Iterator[Any]]) -> Iterator[Iterator[Any]]:
    """Provide what `function` yields for the main file and the limit of memory.

    A crash of usd-core becomes a FormatError, or an UnsupportedError if it had about as much memory as it may.
    """
    with temporary_files.temp_input(inputs, inputs.main, ending) as path:
        limit = limit_for(os.stat(path).st_size)
        try:
            with run_in_child(function, path, limit, limit_bytes=limit) as messages:
                yield messages
        except ChildEndedError as error:
            if error.peak_bytes > NEAR_LIMIT * limit:
                raise UnsupportedError(
                    f"usd-core needs more than {limit / 1e9:.3g} GB of memory for it", help="raise `memory_limit`"
                ) from None
            raise FormatError(f"{usd_meshes.UNREADABLE}: usd-core crashed", help=usd_meshes.MORE_MEMORY) from None
