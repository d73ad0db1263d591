"""Names for a file whose own name another one has: with the first digits of a hash of its content."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import PurePosixPath

DIGEST_LENGTHS = (8, 16, 64)  # hex digits of SHA-256 in a name; shorter ones may be in use by other files


def content_names(name: str, digest: Callable[[], str]) -> Iterator[str]:
    """Yield the names to try: the own one, then some from `digest`, the SHA-256 in hex, which is computed if needed.

    content_names("a/skin.png", …) → "a/skin.png", "a/skin-1a2b3c4d.png", …
    """
    yield name
    path, found = PurePosixPath(name), digest()
    yield from (str(path.with_name(f"{path.stem}-{found[:length]}{path.suffix}")) for length in DIGEST_LENGTHS)
