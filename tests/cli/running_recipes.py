"""Folders with recipes, and the journal of a run."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

from tests.cli.conftest import Call
from tests.cli.running import built
from tests.fixtures.reading import split

PLAIN = ("resample --fps 12",)
STEPS = ("resample --fps 30", "optimize --max-error 0.5mm --effort fast")


def write_recipe(
    folder: Path, *steps: str, match: str = "crowd/**/*.glb", out: str = "build/{path}", **more: str
) -> None:
    """Write or extend gltf-anim.toml."""
    values = {"match": match, "steps": list(steps or STEPS), "out": out, **more}
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    path = folder / "gltf-anim.toml"
    path.write_text((path.read_text() if path.exists() else "") + f"[[recipe]]\n{lines}")


def write_crowd(folder: Path, **files: str) -> None:
    """Write fixtures to crowd/: write_crowd(folder, hero="biped")."""
    (folder / "crowd").mkdir(exist_ok=True)
    for name, fixture in files.items():
        (folder / "crowd" / f"{name}.glb").write_bytes(built(fixture))


def write_long_run(folder: Path, count: int) -> None:
    """Write files with work for some seconds, and their recipe."""
    (folder / "crowd").mkdir()
    for index in range(count):
        (folder / f"crowd/{index:02}.glb").write_bytes(variant(built("biped"), index))
    write_recipe(folder, "resample --fps 60", "spline")


def variant(data: bytes, number: int) -> bytes:
    """The GLB with other content of the same motion."""
    document, blob = split(data)
    document["asset"] = {**document["asset"], "extras": {"number": number}}
    content = json.dumps(document).encode()
    content += b" " * (-len(content) % 4)
    chunks = struct.pack("<I4s", len(content), b"JSON") + content + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def journal(folder: Path) -> list[dict[str, Any]]:
    """The entries of files in the journal."""
    lines = (folder / ".gltf-anim-cache" / "journal.jsonl").read_text().splitlines()
    return [entry for line in lines if line and "input" in (entry := json.loads(line))]


def statuses(folder: Path) -> dict[str, str]:
    """Status of each input in the journal."""
    return {entry["input"]: entry["status"] for entry in journal(folder)}


def built_files(folder: Path) -> set[str]:
    """Return the names of the files in build/."""
    return {path.relative_to(folder).as_posix() for path in (folder / "build").rglob("*") if path.is_file()}


def run_with_a_deleted_input(folder: Path, call: Call) -> Path:
    """Return the folder after a run of two files, of which one input is deleted after it."""
    write_crowd(folder, hero="biped", cube="morph_cube")
    (folder / "crowd/arm 1.glb").unlink()
    write_recipe(folder, *PLAIN)
    call("run").product()
    (folder / "crowd/cube.glb").unlink()
    return folder
