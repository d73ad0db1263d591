"""Options shared by several commands."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from cli.errors import UsageError
from cli.io.output_names import MAX_FILES

# Meters per unit. Numbers in files are at most 1e15, too: their products with a scale are lengths that float32 holds,
# and a kilometer divided by one can be read again.
MIN_SCALE, MAX_SCALE = 1e-12, 1e15

Input = Annotated[str, typer.Argument(metavar="IN", help="A .glb or .gltf file, '-' for stdin.", show_default=False)]
Output = Annotated[
    str, typer.Argument(metavar="OUT", help="A .glb or .gltf file, '-' for stdout (GLB).", show_default=False)
]
More = Annotated[
    list[str] | None, typer.Argument(metavar="FILE...", help="More inputs, with --out.", show_default=False)
]
Out = Annotated[
    str | None,
    typer.Option(
        "--out",
        "-o",
        metavar="NAME",
        help="Output of each file, where all names are inputs, also folders and patterns: out/ or out/{path}, or "
        "{folder}, {name}, {stem}. Its folders are made.",
    ),
]
Clips = Annotated[
    list[str] | None,
    typer.Option("--clip", metavar="GLOB", help="Only clips with this name or index ('#0'); may be repeated."),
]
Nodes = Annotated[
    list[str] | None, typer.Option("--node", metavar="GLOB", help="Only nodes with this name; may be repeated.")
]


class Path(StrEnum):
    """Animated node property."""

    TRANSLATION = "translation"
    ROTATION = "rotation"
    SCALE = "scale"
    WEIGHTS = "weights"


Paths = Annotated[list[Path] | None, typer.Option("--path", help="Only tracks of this property; may be repeated.")]


class Format(StrEnum):
    """Report format."""

    TEXT = "text"
    JSON = "json"


Report = Annotated[Format, typer.Option("--format", help="Report format: text or one JSON document.")]
From = Annotated[float | None, typer.Option("--from", metavar="S", help="Start time in seconds.")]
To = Annotated[float | None, typer.Option("--to", metavar="S", help="End time in seconds.")]
MaxFiles = Annotated[
    int | None,
    typer.Option(
        "--max-files",
        metavar="N",
        min=1,
        help=f"Names with {{clip}} or {{mesh}}: at most N files, default {MAX_FILES}.",
        show_default=False,
    ),
]
Html = Annotated[
    str | None,
    typer.Option("--html", metavar="OUT", help="Write a page for the browser, as `view` does: a .html file."),
]
DryRun = Annotated[bool, typer.Option("--dry-run", "-n", help="Write nothing.")]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Print only errors, warnings and requested output."),
]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Print details, such as a line per clip.")]


def check_scale(scale: float | None) -> None:
    """Raise UsageError for meters per unit out of their range."""
    if scale is not None and not MIN_SCALE <= scale <= MAX_SCALE:
        raise UsageError(f"--scale is {scale:g} (expected {MIN_SCALE:g} to {MAX_SCALE:g})")
