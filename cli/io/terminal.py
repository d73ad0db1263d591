"""The terminal on stdout: its protocol for pictures and its size."""

from __future__ import annotations

import os
import shutil
import struct
import sys
from collections.abc import Mapping
from contextlib import suppress

from anim.show.terminal.picture import Protocol, TerminalSize, encode_picture
from cli.errors import UsageError
from cli.io import documents, stdout
from cli.streams import step_streams

# By $TERM_PROGRAM, by $TERM, and by variables that only one terminal sets; the first match counts
PROGRAMS = {
    "iTerm.app": Protocol.ITERM2,
    "WezTerm": Protocol.ITERM2,
    "mintty": Protocol.ITERM2,
    "rio": Protocol.ITERM2,
    "ghostty": Protocol.KITTY,
}
TERMS = {
    "xterm-kitty": Protocol.KITTY,
    "xterm-ghostty": Protocol.KITTY,
    "wezterm": Protocol.ITERM2,
    "foot": Protocol.SIXEL,
    "foot-extra": Protocol.SIXEL,
    "mlterm": Protocol.SIXEL,
    "contour": Protocol.SIXEL,
}
MULTIPLEXERS = ("TMUX", "STY", "ZELLIJ")  # do not pass pictures on
TRUE_COLOR = ("truecolor", "24bit")  # of $COLORTERM


def choose_protocol(*, asked: bool, protocol: Protocol | None, output: str) -> Protocol | None:
    """Return the protocol to print a picture with, None to write a file or to a pipe.

    asked: True for --terminal. Without it, and without OUT, a terminal that shows pictures gets one.
    Raises UsageError if there is an OUT too, or for a terminal that shows no pictures.
    """
    if asked or protocol is not None:
        if output != documents.PIPE:
            raise UsageError(f"--terminal prints the picture, but OUT is {output}", help="leave out one of both")
        return protocol or detect_protocol(os.environ)
    if output != documents.PIPE or step_streams() is not None or sys.stdout is None or not sys.stdout.isatty():
        return None
    found = detect_protocol(os.environ)
    if found is Protocol.BLOCKS:
        raise UsageError(
            "the picture is binary and stdout is a terminal",
            help="name an output file, pipe it on, or add --terminal for a picture of half-block characters",
        )
    return found


def detect_protocol(environment: Mapping[str, str]) -> Protocol:
    """Return the protocol of the terminal that an environment describes; blocks if none is known."""
    if any(environment.get(name) for name in MULTIPLEXERS):
        return Protocol.BLOCKS
    if environment.get("KITTY_WINDOW_ID") or environment.get("KONSOLE_VERSION"):
        return Protocol.KITTY
    if environment.get("LC_TERMINAL") == "iTerm2":  # passed on by ssh
        return Protocol.ITERM2
    by_program = PROGRAMS.get(environment.get("TERM_PROGRAM", ""))
    return by_program or TERMS.get(environment.get("TERM", ""), Protocol.BLOCKS)


def print_picture(png: bytes, protocol: Protocol, *, line_width: int = 0) -> None:
    """Write a PNG to stdout as a picture. line_width: pixels of dark lines on a light ground, 0 without."""
    stdout.write([encode_picture(png, protocol, terminal_size(os.environ), line_width=line_width)])


def terminal_size(environment: Mapping[str, str]) -> TerminalSize:
    """Return the size of the terminal on stdout, else of that on stderr or stdin; $COLUMNS counts first."""
    is_true_color = environment.get("COLORTERM", "").lower() in TRUE_COLOR
    for stream in (sys.__stdout__, sys.__stderr__, sys.__stdin__):
        with suppress(OSError, ValueError, AttributeError, ImportError):  # no terminal, closed, none; Windows
            import fcntl
            import termios

            descriptor = stream.fileno()  # type: ignore[union-attr]
            answer = fcntl.ioctl(descriptor, termios.TIOCGWINSZ, bytes(8))
            _, columns, width, _ = struct.unpack("HHHH", answer)
            if columns and not environment.get("COLUMNS"):
                return TerminalSize(columns, width, is_true_color)
    return TerminalSize(shutil.get_terminal_size().columns, 0, is_true_color)
