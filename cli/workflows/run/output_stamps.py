"""Stamps of an output with its buffers and images, by which later runs know whether somebody has changed it."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from anim.gltf.io.unused_buffers import external_buffers
from cli.workflows.run.stamps import Stamp, stamp_of


class OutputStamps(NamedTuple):
    """Stamps of an output. buffers, copies: of its buffers and of images that were copied beside it, by name."""

    output: Stamp
    buffers: Mapping[str, Stamp]
    copies: Mapping[str, Stamp]


def stamp_output(folder: Path, output: str, copies: Collection[str] = ()) -> OutputStamps | None:
    """Return the stamps of an output as it is now; None without one.

    folder: of the settings, from which all names count. copies: images that were copied beside it.
    """
    found = stamp_of(folder / output)
    if found is None:
        return None
    return OutputStamps(found, stamp_buffers(folder, output), _stamps(folder, copies))


def stamp_buffers(folder: Path, output: str) -> dict[str, Stamp]:
    """Return the stamps of the buffers that a .gltf has in other files, by their names from the folder."""
    if not output.lower().endswith(".gltf"):
        return {}
    path = Path(output)
    return _stamps(folder, [(path.parent / name).as_posix() for name in external_buffers(folder / path) if name])


def are_unchanged(folder: Path, stamps: Mapping[str, Stamp]) -> bool:
    """Return whether files are as they were stamped."""
    return all(stamp_of(folder / name) == stamp for name, stamp in stamps.items())


def _stamps(folder: Path, names: Collection[str]) -> dict[str, Stamp]:
    found = {name: stamp_of(os.path.join(folder, name)) for name in names}
    return {name: stamp for name, stamp in found.items() if stamp is not None}
