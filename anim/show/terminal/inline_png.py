"""PNG in the graphics protocol of kitty, and as an inline image of iTerm2."""

from __future__ import annotations

import base64

CHUNK_CHARACTERS = 4096  # of base64 in one escape sequence of kitty, its limit


def encode_kitty(png: bytes) -> bytes:
    """Return the escape sequences that show a PNG at the cursor.

    Source: https://sw.kovidgoyal.net/kitty/graphics-protocol/: a=T transmits and shows, f=100 is PNG, q=2 asks for no
    answer, which a shell would read as typed text; m=1 says that more chunks follow.
    """
    text = base64.b64encode(png)
    chunks = [text[i : i + CHUNK_CHARACTERS] for i in range(0, len(text), CHUNK_CHARACTERS)]
    last = len(chunks) - 1
    heads = [b"a=T,f=100,q=2," if i == 0 else b"" for i in range(len(chunks))]
    parts = [b"\x1b_G%sm=%d;%s\x1b\\" % (heads[i], i < last, chunk) for i, chunk in enumerate(chunks)]
    return b"".join(parts) + b"\n"


def encode_iterm2(png: bytes) -> bytes:
    """Return the escape sequence that shows a PNG at the cursor. Source: https://iterm2.com/documentation-images.html."""
    return b"\x1b]1337;File=inline=1;size=%d:%s\x07\n" % (len(png), base64.b64encode(png))
