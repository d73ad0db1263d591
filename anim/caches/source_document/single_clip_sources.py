"""Source documents with one animation each, for a run that writes a file per clip."""

from __future__ import annotations

from anim.gltf.document import Document, json_array
from anim.gltf.writing.new_accessors import NewAccessors, edit_document


class SingleClipSources:
    """The documents with one animation of a document, without the accessors that only others use.

    The animations are halved until one is left, and the documents on the way to it are kept: all N of them, asked for
    in order, take O(N log N) steps. Each is otherwise the size of the whole document, O(N²) in all.
    """

    def __init__(self, document: Document) -> None:
        self._halves = [(0, len(json_array(document.json, "animations")), document)]  # first, last + 1 of those in it

    def document(self, index: int) -> Document:
        """Return the document whose only animation is the one at an index; the whole one if it has none."""
        while len(self._halves) > 1 and not self._halves[-1][0] <= index < self._halves[-1][1]:
            self._halves.pop()
        first, end, found = self._halves[-1]
        while end - first > 1:
            middle = (first + end) // 2
            low, high = (first, middle) if index < middle else (middle, end)
            found = _with_animations(found, low - first, high - first)
            first, end = low, high
            self._halves.append((first, end, found))
        return found


def _with_animations(document: Document, first: int, end: int) -> Document:
    """A document without the animations outside first … end − 1."""
    json = {**document.json, "animations": document.json["animations"][first:end]}
    return edit_document(document, json, NewAccessors(len(json_array(document.json, "accessors"))))
