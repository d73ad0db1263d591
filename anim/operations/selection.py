"""Selection of clips, nodes and tracks by globs."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from anim.errors import NotFoundError, RangeError, ShapeError, check_type
from anim.model import Clip, Skeleton
from anim.units import list_some

MAX_SUGGESTED = 3  # names


class Selection(NamedTuple):
    """Globs for names of clips and nodes, and paths of tracks; empty selects all."""

    clips: Sequence[str] = ()
    nodes: Sequence[str] = ()
    paths: Sequence[str] = ()

    def chosen_clips(self, names: Sequence[str]) -> list[int]:
        """Return the indices of the selected clips; the name of an unnamed clip is its index, "3".

        Raises NotFoundError, with similar names, for a glob that matches no clip.
        """
        return match_names(self.clips, [name or f"#{i}" for i, name in enumerate(names)], "clip")

    def chosen_nodes(self, skeleton: Skeleton) -> list[int]:
        """Return the indices of the selected nodes; the name of an unnamed node is its index."""
        names = [name or str(i) for i, name in enumerate(skeleton.names)]
        return match_names(self.nodes, names, "node")

    def chosen_tracks(self, clip: Clip, skeleton: Skeleton) -> frozenset[int]:
        """Return the indices of the selected tracks of `clip`; pointers only if no node or path is selected."""
        check_type(clip, Clip, "clip")
        check_type(skeleton, Skeleton, "skeleton")
        nodes = set(self.chosen_nodes(skeleton)) if self.nodes else None
        return frozenset(
            i
            for i, track in enumerate(clip.tracks)
            if (nodes is None or track.node in nodes) and (not self.paths or track.path in self.paths)
        )


def track_indices(clip: Clip, tracks: Collection[int] | None) -> frozenset[int]:
    """Return the indices of the tracks to change, all for None.

    Raises ShapeError for another type of clip or index, RangeError for an index without a track.
    """
    check_type(clip, Clip, "clip", help="asset.map_clips(...) changes the clips of an asset, asset.clips[0] is one")
    count = len(clip.tracks)
    if tracks is None:
        return frozenset(range(count))
    if not isinstance(tracks, Collection) or not all(isinstance(i, int | np.integer) for i in tracks):
        raise ShapeError(f"tracks is {tracks!r} (expected indices)", help="ops.select_tracks gives those of some nodes")
    if strange := [i for i in tracks if not 0 <= i < count]:
        raise RangeError(f"there is no track {strange[0]} (the clip has {count}, from 0 on)")
    return frozenset(tracks)


def match_names(globs: Sequence[str], names: Sequence[str], what: str) -> list[int]:
    """Return the indices of the names that match any of the globs; all without globs.

    "#3" is index 3, with any name; one that is called "#3" is "[#]3", if it is not index 3. A glob that is a name
    itself, "Run[1]", is that name only. Upper and lower case differ.
    Raises NotFoundError, with similar names, for a glob that matches none.
    """
    if not globs:
        return list(range(len(names)))
    chosen: set[int] = set()
    for glob in globs:
        found = _matches(glob, names)
        if not found:
            raise not_found(glob, names, what)
        chosen |= found
    return sorted(chosen)


def not_found(name: str, names: Iterable[str], what: str) -> NotFoundError:
    """Return the error for a name or glob without match, with similar names."""
    return NotFoundError(f"no {what} matches '{name}'", help=_suggestion(name, names, what))


def parse_index(text: str, count: int) -> int | None:
    """Return the index that a text like "#3" is among `count` items; None for other texts, and for "#03"."""
    is_index = re.fullmatch(r"#(0|[1-9][0-9]{0,8})", text) and int(text[1:]) < count
    return int(text[1:]) if is_index else None


def _matches(glob: str, names: Sequence[str]) -> set[int]:
    """The index that `glob` is, else indices of the names that are `glob` itself, otherwise of those that match it."""
    index = parse_index(glob, len(names))
    if index is not None:
        return {index}
    exact = {i for i, name in enumerate(names) if glob == name or (name == f"#{i}" and glob == str(i))}
    return exact or {i for i, name in enumerate(names) if fnmatchcase(name, glob)}


def _suggestion(glob: str, names: Iterable[str], what: str) -> str:
    known = list(dict.fromkeys(names))
    if respelled := _in_other_case(glob, known):
        return f"upper and lower case differ: did you mean {respelled}?"
    folded = {name.casefold(): name for name in known}
    near = difflib.get_close_matches(glob.casefold(), folded, n=1)
    if near:
        return f"did you mean '{folded[near[0]]}'?"
    if not known:
        return f"the file has no {_plural(what)}"
    names = [f"'{name}'" for name in known]
    return f"the {_plural(what)} are {list_some(names)}"


def _in_other_case(glob: str, names: Sequence[str]) -> str:
    """The glob in the case of the names that it matches apart from case, or some of these names; "" without any."""
    found = [name for name in names if fnmatchcase(name.casefold(), glob.casefold())]
    for spelled in (glob.lower(), glob.upper(), glob.title(), glob.capitalize()):
        if found and all(fnmatchcase(name, spelled) for name in found):
            return f"'{spelled}'"
    return " or ".join(f"'{name}'" for name in found[:MAX_SUGGESTED])


def _plural(nouns: str) -> str:
    """Plural of a noun, or of several: "mesh or node" → "meshes or nodes"."""
    return " or ".join(f"{noun}es" if noun.endswith("sh") else f"{noun}s" for noun in nouns.split(" or "))
