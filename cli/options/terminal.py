"""Options of pictures in the terminal."""

from __future__ import annotations

from typing import Annotated

import typer

from anim.show.terminal.picture import Protocol

Terminal = Annotated[
    bool,
    typer.Option(
        "--terminal", help="Print the picture to the terminal, in half-block characters where it shows no pictures."
    ),
]
PictureProtocol = Annotated[
    Protocol | None,
    typer.Option("--protocol", help="Protocol for --terminal (default: from the environment).", show_default=False),
]
