"""The files that a bake writes: one for each clip, or mesh, or both."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from anim.errors import UnsupportedError
from anim.model import Scene
from anim.skinning.bake import bakeable_instances
from cli.errors import UsageError
from cli.io import cache_files, documents, output_names

PLACEHOLDERS = ("mesh", "clip")


@dataclass(frozen=True, slots=True)
class BakeJob:
    """An output file to write: indices of its meshes and of its clip; None for a file without clips.

    makes_folder: whether its name was filled in, so that its folder is made.
    """

    file: str
    group: int
    clip: int | None
    makes_folder: bool


MeshGroup = tuple[str, Sequence[int] | None]  # value of {mesh}, and the nodes of the meshes; None for all


def mesh_groups(scene: Scene, nodes: Sequence[int] | None, output: str, *, rigid: bool) -> list[MeshGroup]:
    """Return the meshes grouped by output file: one group per mesh if OUT contains {mesh}."""
    if "{mesh}" not in output:
        return [("", nodes)]
    chosen = {each.node: each.mesh.name for each in bakeable_instances(scene, rigid=rigid, nodes=nodes)}
    return [(name or scene.skeleton.names[node], [node]) for node, name in chosen.items()] or [("", nodes)]


def bake_jobs(
    output: str,
    ending: str,
    groups: Sequence[MeshGroup],
    clips: Sequence[tuple[str, int]],
    max_files: int | None = None,
) -> list[BakeJob]:
    """Return all output files, with their names expanded and checked. clips: name and index of each.

    Raises UnsupportedError if they are more than max_files, by default output_names.MAX_FILES.
    """
    if "{clip}" not in output and len(clips) > 1:
        raise UsageError(
            f"{len(clips)} clips are chosen, but '{output}' holds one",
            help="choose one with --clip, or put {clip} into OUT for a file per clip",
        )
    each_clip: Sequence[tuple[str, int | None]] = clips or [("", None)]
    count, most = len(groups) * len(each_clip), max_files or output_names.MAX_FILES
    if count > most:
        raise UnsupportedError(
            f"'{output}' stands for {count} files (limit {most})",
            help="choose clips with --clip, or raise the limit with --max-files",
        )
    pairs = [(i, name, clip) for i in range(len(groups)) for name, clip in each_clip]
    rows = [{"mesh": groups[i][0], "clip": name} for i, name, _ in pairs]
    by_clip = "{clip}" in output
    files = output_names.expand(output, rows, [(clip or 0) if by_clip else i for i, _, clip in pairs])
    is_filled_in = any(f"{{{each}}}" in output for each in PLACEHOLDERS)
    if len(files) > 1 or "{" in output:
        _check_files(files, ending, makes_folder=is_filled_in)
    return [BakeJob(file, i, clip, is_filled_in) for file, (i, _, clip) in zip(files, pairs, strict=True)]


def _check_files(files: Sequence[str], ending: str, *, makes_folder: bool) -> None:
    """Raise UsageError or OutputError for a file that can't be written; of new ones the first of each folder tells."""
    checked: set[tuple[str, str]] = set()  # folders and file extensions of new files
    for file in files:
        key = os.path.dirname(file), os.path.splitext(file)[1]
        is_new = bool(file) and file != documents.PIPE and _is_missing(file)
        if not (is_new and key in checked):
            cache_files.check(file, ending, placeholders=None, makes_folder=makes_folder)
        if is_new:
            checked.add(key)


def _is_missing(file: str) -> bool:
    try:
        os.lstat(file)
    except FileNotFoundError:
        return True
    except (OSError, ValueError):  # an invalid name
        return False
    return False
