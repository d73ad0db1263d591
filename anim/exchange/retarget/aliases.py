"""Alias files: target names by source joint, for names that do not match automatically."""

from __future__ import annotations

import csv
import io

from anim.errors import FormatError
from anim.exchange.formats.text import decode_text, error_at
from anim.gltf.io import json_text


def read(data: bytes) -> dict[str, str]:
    """Return target names by source name, from a JSON object or from CSV lines "source,target".

    An empty target omits the joint; in CSV, lines that begin with # are comments. Raises FormatError with the line.
    b"LeftArm,upperarm.l\\nLFingers,\\n" → {"LeftArm": "upperarm.l", "LFingers": ""}
    """
    if data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{":
        content = json_text.parse(data)
        for name, other in content.items():
            if not isinstance(other, str):
                raise FormatError(f"'{name}' has {other!r} (expected the name of a node)")
        return content
    found: dict[str, str] = {}
    rows = csv.reader(io.StringIO(decode_text(data)), strict=True)
    try:
        for cells in rows:
            if not cells or cells[0].startswith("#"):
                continue
            if len(cells) != 2 or not cells[0].strip():
                raise error_at(rows.line_num, f"{len(cells)} columns (expected source,target)")
            found[cells[0].strip()] = cells[1].strip()
    except csv.Error as error:
        raise error_at(rows.line_num, f"broken CSV ({error})") from None
    return found
