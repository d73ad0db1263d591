"""Files that tests read: fixtures and real ones, by name, as documents; and documents as the bytes of a file."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fixtures
from anim.errors import FormatError
from anim.gltf.document import Bytes, Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.model import Clip

SHARED = Path(__file__).resolve().parents[2] / "shared"
ASSETS = SHARED / "assets"
BAD_INPUTS = SHARED / "bad-inputs"

# Every glTF file with clips in shared/assets, by its path there.
REAL = (
    "AnimationPointer/24_animation_pointer.gltf",
    "BitmojiRun.glb",
    "BoxAnimated.gltf",
    "BusterDrone/busterDrone.gltf",
    "CesiumMan-gltf/CesiumMan.gltf",
    "CesiumMan.glb",
    "CubicMorph/01_cs_morph.gltf",
    "CubicRotate/01_cs_rotate.gltf",
    "Fox.glb",
    "InterpolationTest.gltf",
    "Knight.glb",
    "MorphStressTest.glb",
    "RiggedSimple.gltf",
    "Robot.glb",
    "SimpleMorph.gltf",
    "SimpleSkin.gltf",
    "vrm/test.vrma",
)
LARGE = ("BusterDrone/busterDrone.gltf", "Knight.glb", "Robot.glb")


def mark_slow(values: Iterable[Any], slow: Container[Any] = LARGE) -> list[Any]:
    """Return values for `parametrize`, or tuples of them, of which the quick set leaves out those in `slow`."""
    return [
        pytest.param(*(each if isinstance(each, tuple) else (each,)), marks=pytest.mark.slow) if each in slow else each
        for each in values
    ]


def opened(data: bytes, files: Mapping[str, bytes] | None = None) -> Document:
    """Return the document in the bytes of a file. files: what lies beside it, by relative path."""
    return container.read(np.frombuffer(data, np.uint8), None if files is None else lambda path: _beside(files, path))


def opened_path(path: Path) -> Document:
    """Return the document of a file on disk, with what lies beside it."""
    return container.read(np.fromfile(path, np.uint8), lambda address: _on_disk(path.parent / address))


def opened_fixture(name: str) -> Document:
    """Return the document of a fixture, with what lies beside it."""
    files = fixtures.build_files(name)
    return opened(next(iter(files.values())), files)


def joined(pieces: Sequence[Bytes]) -> bytes:
    """Return the pieces of a file as its bytes."""
    return b"".join(piece.tobytes() for piece in pieces)


def glb_of(document: Document) -> bytes:
    """Return the document as the bytes of a GLB."""
    return joined(container.glb(document))


def _beside(files: Mapping[str, bytes], path: str) -> Bytes:
    try:
        return np.frombuffer(files[path], np.uint8)
    except KeyError:
        raise FormatError(f"'{path}' is not beside the file") from None


def _on_disk(path: Path) -> Bytes:
    if not path.is_file():
        raise FormatError(f"'{path.name}' is not beside the file")
    return np.fromfile(path, np.uint8)


def clips_of(data: bytes) -> tuple[Clip, ...]:
    """Return the clips in the bytes of a file that needs no other."""
    return reader.clips(opened(data))
