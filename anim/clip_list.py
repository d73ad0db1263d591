"""Clips of an asset, by index or by name."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from typing import overload

from anim.errors import NotFoundError, ShapeError
from anim.gltf.reading import reader
from anim.model import Clip
from anim.operations.selection import not_found, parse_index
from anim.units import list_some


class Clips:
    """The clips of an asset, by index or by name: `clips[0]`, `clips["walk"]`, `clips["#0"]`."""

    def __init__(self, clips: Sequence[Clip]) -> None:
        self._clips = tuple(clips)

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the order of the file; "#3" for clip 3 where it has none."""
        return tuple(reader.clip_name(clip.name, i) for i, clip in enumerate(self._clips))

    def index_of(self, key: int | str) -> int:
        """Return the index of a clip by name or index. Raises NotFoundError, with similar names."""
        if not isinstance(key, str):
            return self._checked(key)
        index = parse_index(key, len(self))
        if index is not None:
            return index
        found = [i for i, name in enumerate(self.names) if name == key]
        if len(found) > 1:
            raise NotFoundError(f"{len(found)} clips are called '{key}'", help=f"take one by its index: {found}")
        if not found:
            raise not_found(key, self.names, "clip")
        return found[0]

    @overload
    def __getitem__(self, key: int | str) -> Clip: ...
    @overload
    def __getitem__(self, key: slice) -> tuple[Clip, ...]: ...
    def __getitem__(self, key: int | str | slice) -> Clip | tuple[Clip, ...]:
        return self._clips[key] if isinstance(key, slice) else self._clips[self.index_of(key)]

    def __len__(self) -> int:
        return len(self._clips)

    def __iter__(self) -> Iterator[Clip]:
        return iter(self._clips)

    def __contains__(self, key: str | Clip) -> bool:
        return key in self.names if isinstance(key, str) else any(clip is key for clip in self._clips)

    def __repr__(self) -> str:
        return f"Clips({', '.join(self.names)})"

    def _checked(self, key: int) -> int:
        if isinstance(key, bool):  # an index for Python: clips[len(clips) > 1] is a slip
            raise ShapeError("a clip is taken by bool (expected its name or its index)")
        try:
            index = range(len(self))[operator.index(key)]
        except TypeError:
            raise ShapeError(f"a clip is taken by {type(key).__name__} (expected its name or its index)") from None
        except IndexError:
            count = f"{len(self)} clips: {list_some(self.names)}" if self._clips else "no clips"
            raise NotFoundError(f"there is no clip {key} (the file has {count})") from None
        return index
