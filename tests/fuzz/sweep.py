"""Every value of every JSON of the sound inputs replaced by each of `VALUES`, for what random mutations rarely meet."""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from itertools import cycle
from typing import Any

from tests.fixtures.reading import split
from tests.fuzz.execution import Job
from tests.fuzz.families import command_words, seeds
from tests.fuzz.mutations import VALUES, places
from tests.fuzz.simulation_seeds import pack


def sweep_jobs(family: str) -> Iterator[Job]:
    """Yield the jobs of a family's JSON files, each with one value replaced; the command lines take turns."""
    for sound in seeds(family):
        lines = cycle([command_words(line, sound.main) for line in sound.lines])
        for name in sound.mutated:
            for changed in _changed(name, sound.files[name]):
                yield Job(next(lines), {**sound.files, name: changed})


def _changed(name: str, data: bytes) -> Iterator[bytes]:
    is_glb = name.endswith(".glb")
    if not is_glb and not name.endswith((".gltf", ".json")):
        return
    document, blob = split(data) if is_glb else (json.loads(data), b"")
    for number, _ in enumerate(list(places(document))):
        for value in VALUES:
            changed: Any = deepcopy(document)
            parent, key = list(places(changed))[number]
            parent[key] = value
            yield pack(changed, blob) if is_glb else json.dumps(changed).encode()
