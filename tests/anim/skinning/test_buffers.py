"""Memory is given again only when nobody holds it."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from anim.model import Clip
from anim.skinning import stream
from anim.skinning.bake import baker
from anim.skinning.buffers import Buffers
from tests.anim.skinning.scenes import random_scene


def place(array: np.ndarray) -> int:
    return int(array.__array_interface__["data"][0])


def test_what_is_held_is_not_given_again_and_what_is_let_go_is() -> None:
    buffers = Buffers()
    first = buffers.array(4, 10, 3)
    view, where = first[1:, 2], place(first)
    del first
    gc.collect()
    other = buffers.array(4, 10, 3)
    assert not np.shares_memory(other, view), "a view is enough to hold it"
    del view
    gc.collect()
    assert place(buffers.array(2, 10, 3)) == where, "also for less"


def test_chunks_that_are_kept_stay_as_they_were() -> None:
    made = baker(random_scene(2, vertices=300))
    times = np.linspace(0, 40, 1200)
    kept = list(made.bake(Clip("", ()), times=times).chunks())
    copies = [chunk.positions.copy() for chunk in kept]
    for _ in made.bake(Clip("", ()), times=times).chunks():
        pass
    assert len(kept) > 1
    assert all(np.array_equal(chunk.positions, copy) for chunk, copy in zip(kept, copies, strict=True))


def test_a_stream_takes_memory_for_few_chunks_however_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is used and one that is made; a third where its maker is faster than the caller lets go of the first."""
    monkeypatch.setattr(stream, "CHUNK", 1)
    made = baker(random_scene(2, vertices=300))
    count = sum(1 for _ in made.bake(Clip("", ()), times=np.linspace(0, 40, 1200)).chunks())
    assert count == 38
    assert len(made.buffers._lent) <= 3
