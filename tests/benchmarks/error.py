"""How far the clips of one file are from those of another, by our own ruler, for outputs of peers too.

python -m tests.benchmarks.error BEFORE AFTER → one JSON object: metres, share of the diagonal
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from tests.files import opened_path


def main(before: str, after: str) -> dict[str, float]:
    """Return the largest distance that any vertex moved in any clip; clips are matched by their number."""
    old, new = opened_path(Path(before)), opened_path(Path(after))
    ruler = ErrorMetric(reader.scene(old))
    errors = [ruler.error(*clips).max_error for clips in zip(reader.clips(old), reader.clips(new), strict=True)]
    return {"max_error_m": max(errors), "share": max(errors) / ruler.diagonal}


if __name__ == "__main__":
    json.dump(main(*sys.argv[1:]), sys.stdout)
