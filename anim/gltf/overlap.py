"""Time axes that are a part of a longer one: they need no bytes of their own."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from anim.gltf.writing.byte_ranges import ALIGNMENT
from anim.gltf.writing.encoding import AccessorData


def inside(contents: Sequence[AccessorData]) -> dict[int, tuple[int, int]]:
    """Return, for each time axis that occurs in another, (number of that one, byte offset in it).

    The longest come first; what lies in another is no place for a third one to lie in. Only axes are looked at: they
    are the contents with bounds.
    """
    axes = [i for i, each in enumerate(contents) if each.bounds is not None]
    found: dict[int, tuple[int, int]] = {}
    joined, starts, owners = bytearray(), [0], list[int]()
    for i in sorted(axes, key=lambda i: -len(contents[i].data)):
        data = contents[i].data
        at = _find(joined, data, starts)
        if at < 0:
            owners.append(i)
            joined += data
            starts.append(len(joined))
        else:
            k = bisect_right(starts, at) - 1
            found[i] = (owners[k], at - starts[k])
    return found


def _find(joined: bytearray, data: bytes, starts: list[int]) -> int:
    """Where `data` lies within one of the pieces that begin at `starts`, −1 for nowhere."""
    at = joined.find(data)
    while at >= 0:
        end = starts[bisect_right(starts, at)]
        if at % ALIGNMENT == 0 and at + len(data) <= end:
            return at
        at = joined.find(data, at + 1)
    return -1
