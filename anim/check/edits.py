"""Edits of documents that fixes share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence
from anim.gltf.document import Document
from anim.gltf.writing import writer
from anim.model import Track


def edit_tracks(file: CheckedFile, found: Sequence[Occurrence], edit: Callable[[Track], Track]) -> Document:
    """Return the document with edited tracks in the clips of the occurrences."""
    clips = {}
    for number in {each.number for each in found}:
        clip = file.contents.clips[number]
        tracks = tuple(map(edit, clip.tracks))
        if any(new is not old for new, old in zip(tracks, clip.tracks, strict=True)):
            clips[number] = replace(clip, tracks=tracks)
    return writer.replace_clips(file.document, clips)


def rename_clips(document: Document, names: Mapping[int, str]) -> Document:
    """Return the document with other names of clips, by index."""
    animations = [
        {**each, "name": names[i]} if i in names else each for i, each in enumerate(document.json["animations"])
    ]
    return replace(document, json={**document.json, "animations": animations})


def free_name(name: str, taken: set[str]) -> str:
    """Return a name that is not taken, with a number from 2 on if needed, and add it to those that are."""
    free = name if name not in taken else next(f"{name}_{i}" for i in count(2) if f"{name}_{i}" not in taken)
    taken.add(free)
    return free
