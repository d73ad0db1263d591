"""Clips with equal tracks: they move alike, so that one measurement is enough for all of them."""

from __future__ import annotations

import operator
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from anim.model import Clip, Track


def first_equal(items: Sequence[tuple[Clip, ...]]) -> list[int]:
    """Return for each item the index of the first one with equal clips, whatever their names.

    first_equal([(walk,), (run,), (walk_copy,)]) → [0, 1, 0]
    """
    sizes = [tuple(map(_size, item)) for item in items]
    counts = Counter(sizes)
    first: dict[object, int] = {}
    return [
        first.setdefault(tuple(map(tracks_digest, item)) if counts[size] > 1 else i, i)
        for i, (item, size) in enumerate(zip(items, sizes, strict=True))
    ]


def tracks_digest(clip: Clip) -> bytes:
    """Return a digest of a clip's tracks."""
    import hashlib  # loads OpenSSL, and few files have clips to hash

    digest = hashlib.blake2b(digest_size=16)
    for track in clip.tracks:
        for part in _parts(track):
            digest.update(part)
    return digest.digest()


def repeat_change(clip: Clip, old: Clip, new: Clip) -> Clip:
    """Return a clip after the change that made `new` of `old`, a clip with equal tracks; itself if nothing changed."""
    is_same = len(new.tracks) == len(old.tracks) and all(map(operator.is_, new.tracks, old.tracks))
    return clip if is_same else replace(new, name=clip.name)


def _size(clip: Clip) -> tuple[int, ...]:
    """Numbers of values: without this most clips would be hashed for nothing."""
    return tuple(track.values.size for track in clip.tracks)


def _parts(track: Track) -> list[bytes]:
    arrays = (track.times, track.values, track.in_tangents, track.out_tangents)
    numbers = [b"" if each is None else each.tobytes() for each in arrays]
    target = (track.node, track.path, track.interpolation, track.pointer, track.storage)
    header = repr((*target, track.values.shape, *map(len, numbers)))
    return [header.encode(errors="surrogatepass"), *numbers]
