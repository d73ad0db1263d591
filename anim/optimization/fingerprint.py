"""A fingerprint of clips and options in `asset.extras`, so that a repeated command changes nothing.

Without it a second run would use the bound a second time, because the source's motion is not in the file.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace

from anim.gltf.document import Document
from anim.model import Clip

KEY = "gltf-anim"


def add_mark(document: Document, clips: Iterable[Clip], options: str) -> Document:
    """Return the document with a mark of its clips and options in `asset.extras`.

    Unchanged if `extras` is no object.
    """
    asset = document.json["asset"]
    extras = asset.get("extras", {})
    if not isinstance(extras, dict):
        return document
    marked = {**asset, "extras": {**extras, KEY: _mark(clips, options)}}
    return replace(document, json={**document.json, "asset": marked})


def has_mark(document: Document, clips: Iterable[Clip], options: str) -> bool:
    """Return whether the document carries the mark of exactly these clips and options."""
    extras = document.json["asset"].get("extras", {})
    mark = extras.get(KEY) if isinstance(extras, dict) else None
    return mark is not None and mark == _mark(clips, options)


def _mark(clips: Iterable[Clip], options: str) -> str:
    digest = hashlib.blake2b(options.encode(), digest_size=6)
    for clip in clips:
        digest.update(clip.name.encode(errors="surrogatepass"))
        for track in clip.tracks:
            digest.update(f"{track.target} {track.interpolation} {track.values.shape}".encode(errors="surrogatepass"))
            for numbers in (track.times, track.values, track.in_tangents, track.out_tangents):
                digest.update(b"" if numbers is None else numbers.tobytes())
    return f"optimize {digest.hexdigest()}"
