"""python -m docs.pages: run every command of the pages, and renew the pictures and the output that they show.

A page is Markdown with commands in ```sh blocks, which run one after the other in a folder with the fixtures. A ```text
block directly behind one shows what its commands print; an image from `pictures/` is a file that they write.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cli.main
import fixtures

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures"
PAGES = sorted(path for path in DOCS.rglob("*.md") if path.name != "commands.md")
INPUTS = ("arm", "biped", "flag", "ponytail", "interpolations", "morph_cube", "tube", "wall")
NUM_COLORS = 256  # of a picture in the repository
NUM_REFINEMENTS = 4  # of the palette, by k-means
BLOCK = re.compile(r"```sh\n(?P<commands>.*?)```(?P<output>\n\n```text\n.*?```)?", re.DOTALL)
PICTURE = re.compile(r"!\[[^\]]+\]\([./]*pictures/([\w-]+\.png)\)")
SHELL = re.compile(r"[|<>;&$*?`\"\\]")  # outside of quotes
DURATION = re.compile(r", took \S+ s\b")  # differs from run to run


def commands(block: str) -> list[str]:
    """Return the command lines of a ```sh block, without comments; a backslash at a line's end continues it."""
    lines = (line.split(" #")[0].strip() for line in re.sub(r"\s*\\\n\s*", " ", block).splitlines())
    return [line for line in lines if line and not line.startswith("#")]


def pictures(text: str) -> list[str]:
    """Return the names of the pictures that a page shows."""
    return PICTURE.findall(text)


def write_inputs(folder: Path) -> None:
    """Write the fixtures that pages use into a folder."""
    for name in INPUTS:
        (folder / f"{name}.glb").write_bytes(fixtures.build(name))


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a line of bash, with the command of this checkout, and return its exit code and all that it prints."""
    if shutil.which("gltf-anim") is None:
        command = re.sub(r"\bgltf-anim ", lambda _: f"'{sys.executable}' -m cli.main ", command)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PYTHONPATH": str(DOCS.parent), "PATH": path}
    call = ["bash", "-o", "pipefail", "-c", command]
    return subprocess.run(
        call, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8", env=environment
    )


def run_here(command: str, folder: Path) -> tuple[int, str]:
    """Run a line, in this process where it needs no shell, which saves half of the time: (exit code, all it prints)."""
    if not command.startswith("gltf-anim ") or SHELL.search(re.sub(r"'[^']*'", "", command)):
        done = run(command, folder)
        return done.returncode, done.stdout
    stream = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    with contextlib.chdir(folder), contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
        code = cli.main.run(shlex.split(command)[1:])
    stream.seek(0)
    return code, stream.read()


def updated(text: str, folder: Path) -> str:
    """Return a page with the output of its commands, which run in the folder; one that fails raises an error."""
    return BLOCK.sub(lambda block: _updated_block(block, folder), text)


def _updated_block(block: re.Match[str], folder: Path) -> str:
    printed = []
    for command in commands(block["commands"]):
        code, text = run_here(command, folder)
        if code:
            raise RuntimeError(f"{command}: exit {code}\n{text}")
        printed.append(text)
    shown = f"```sh\n{block['commands']}```"
    if block["output"]:
        shown += f"\n\n```text\n{DURATION.sub('', ''.join(printed)).strip(chr(10))}\n```"
    return shown


def reduced(picture: bytes) -> bytes:
    """Return a PNG with a palette, a third in size."""
    from PIL import Image

    buffer = io.BytesIO()
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    image.quantize(NUM_COLORS, kmeans=NUM_REFINEMENTS, dither=Image.Dither.NONE).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def main() -> None:
    """Renew all pages and pictures; pictures that no page shows are deleted."""
    PICTURES.mkdir(exist_ok=True)
    shown = set()
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as name:
            write_inputs(Path(name))
            page.write_text(updated(text, Path(name)), encoding="utf-8", newline="\n")
            for picture in pictures(text):
                (PICTURES / picture).write_bytes(reduced((Path(name) / picture).read_bytes()))
                shown.add(picture)
    for path in PICTURES.glob("*.png"):
        if path.name not in shown:
            path.unlink()


if __name__ == "__main__":
    main()
