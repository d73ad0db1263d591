"""`plot` and `render` in a terminal: the protocol from the environment, pictures on stdout, and refusals."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import numpy as np
import pytest

from anim.show.terminal.picture import Protocol
from cli.io.terminal import detect_protocol, terminal_size
from tests.anim.show.terminal.decoding import block_pixels, iterm2_png, kitty_png, pixels_of, sixel_pixels
from tests.cli.conftest import Call, Fixture
from tests.cli.running import ENVIRONMENT, refusal

NAMES = ("KITTY_WINDOW_ID", "KONSOLE_VERSION", "TERM_PROGRAM", "LC_TERMINAL", "TMUX", "STY", "ZELLIJ", "COLUMNS")
EASE = ("plot", "--ease", "linear")


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """A terminal without pictures, 60 cells wide."""
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLORTERM", "truecolor")
    monkeypatch.setenv("COLUMNS", "60")


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({}, "blocks"),
        ({"TERM": "xterm-256color", "COLORTERM": "truecolor"}, "blocks"),
        ({"TERM": "xterm-kitty"}, "kitty"),
        ({"TERM": "xterm-256color", "KITTY_WINDOW_ID": "1"}, "kitty"),
        ({"TERM_PROGRAM": "ghostty"}, "kitty"),
        ({"KONSOLE_VERSION": "230804"}, "kitty"),
        ({"TERM_PROGRAM": "iTerm.app"}, "iterm2"),
        ({"LC_TERMINAL": "iTerm2", "TERM": "xterm"}, "iterm2"),
        ({"TERM_PROGRAM": "WezTerm"}, "iterm2"),
        ({"TERM": "foot"}, "sixel"),
        ({"TERM": "mlterm"}, "sixel"),
        ({"TERM_PROGRAM": "vscode"}, "blocks"),
        ({"TERM_PROGRAM": "Apple_Terminal"}, "blocks"),
        ({"KITTY_WINDOW_ID": "1", "TMUX": "/tmp/tmux-0/default,1,0"}, "blocks"),
        ({"TERM_PROGRAM": "iTerm.app", "ZELLIJ": "0"}, "blocks"),
    ],
)
def test_the_environment_tells_the_protocol(environment: dict[str, str], expected: str) -> None:
    assert detect_protocol(environment) == Protocol(expected)


def test_columns_count_first() -> None:
    assert terminal_size({"COLUMNS": "60"}).columns == 60
    assert terminal_size({"COLORTERM": "24bit"}).is_true_color
    assert not terminal_size({}).is_true_color


def test_a_plot_in_half_blocks(call: Call) -> None:
    shown = block_pixels(call(*EASE, "--terminal").product())
    assert shown.shape[1] == 60
    assert (shown[2] == 255).all(axis=-1).any(), "paper"
    assert shown.min() < 120, "ink"


def test_a_plot_in_every_protocol(call: Call) -> None:
    file = call(*EASE, "-").product()
    sizes = set()
    for protocol, decoded in (("kitty", kitty_png), ("iterm2", iterm2_png)):
        png = decoded(call(*EASE, "--protocol", protocol).product())
        sizes.add(pixels_of(png).shape)
        assert png == file or pixels_of(png).shape[1] == 540
    sizes.add(sixel_pixels(call(*EASE, "--protocol", "sixel").product()).shape)
    assert len(sizes) == 1


def test_a_filmstrip(call: Call, fixture: Fixture, monkeypatch: pytest.MonkeyPatch) -> None:
    run = call("render", fixture("biped"), "--terminal", "--size", "64")
    few = block_pixels(run.product())
    assert few.shape[1] == 60
    assert ", 2 frames, took" in run.err, "of 24 columns each"
    monkeypatch.setenv("COLUMNS", "400")
    run = call("render", fixture("biped"), "--protocol", "kitty", "--size", "64")
    png = call("render", fixture("biped"), "-", "--size", "64").product()
    assert kitty_png(run.product()) == png
    assert ", 8 frames, took" in run.err
    run = call("render", fixture("biped"), "--terminal", "--size", "64", "--frames", "3")
    assert ", 3 frames, took" in run.err
    assert np.isin(block_pixels(run.product()).shape[1], range(100, 401))


@pytest.mark.parametrize("command", ["plot", "render"])
def test_what_contradicts_itself_is_refused(command: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    said = refusal(call(command, fixture("biped"), tmp_path / "a.png", "--terminal"), 2)
    assert said.endswith(f"--terminal prints the picture, but OUT is {tmp_path / 'a.png'}")
    assert refusal(call(command, fixture("biped"), tmp_path / "a.png", "--protocol", "sixel"), 2)
    assert refusal(call(command, fixture("biped"), "--protocol", "ascii"), 2)
    assert not list(tmp_path.glob("*.png"))


def test_svg_is_refused(call: Call) -> None:
    assert "shows no SVG" in refusal(call(*EASE, "--terminal", "--format", "svg"), 2)


@pytest.mark.parametrize(("kitty", "code"), [("1", 0), ("", 2)])
def test_a_terminal_that_shows_pictures_needs_no_option(kitty: str, code: int) -> None:
    """In a pseudo-terminal of 50 columns and 400 pixels."""
    outer, inner = pty.openpty()
    fcntl.ioctl(inner, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 50, 400, 480))
    environment = {name: value for name, value in ENVIRONMENT.items() if name not in NAMES}
    environment |= {"TERM": "xterm-256color", "KITTY_WINDOW_ID": kitty}
    attributes = termios.tcgetattr(inner)
    attributes[1] &= ~termios.OPOST  # line ends stay as they are
    termios.tcsetattr(inner, termios.TCSANOW, attributes)
    command = [sys.executable, "-m", "anim", *EASE]
    with subprocess.Popen(command, env=environment, stdout=inner, stderr=subprocess.PIPE) as process:
        os.close(inner)
        shown = b"".join(iter(lambda: _read(outer), b""))
        assert process.stderr is not None
        said = process.stderr.read().decode()
    os.close(outer)
    assert process.returncode == code, said
    if code:
        assert shown == b""
        assert said.splitlines()[-1].endswith("or add --terminal for a picture of half-block characters")
    else:
        assert pixels_of(kitty_png(shown)).shape[1] <= 400
        assert said == ""


def _read(terminal: int) -> bytes:
    """The next bytes, none at the end, which Linux reports as an error."""
    try:
        return os.read(terminal, 65536)
    except OSError:
        return b""
