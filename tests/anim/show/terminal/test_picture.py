"""Pictures for terminals, decoded by other code: the same pixels, in every protocol."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image

from anim.show.filmstrip import image_file
from anim.show.terminal.half_blocks import encode_half_blocks, nearest_of_256
from anim.show.terminal.picture import Protocol, TerminalSize, encode_picture
from anim.show.terminal.sixel import encode_sixel
from tests.anim.show.terminal.decoding import (
    Pixels,
    block_pixels,
    iterm2_png,
    kitty_png,
    pixels_of,
    sixel_pixels,
    xterm,
)

PERCENT = 2  # levels of 255, the rounding of sixel's colors


def _noise(height: int, width: int, seed: int = 0) -> Pixels:
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)


def _smooth(height: int, width: int) -> Pixels:
    y, x = np.mgrid[:height, :width]
    return np.stack((x * 255 // width, y * 255 // height, (x + y) % 256), axis=-1).astype(np.uint8)


def _reduced(image: Pixels, width: int) -> Pixels:
    height = max(round(image.shape[0] * width / image.shape[1]), 1)
    return np.asarray(Image.fromarray(image).resize((width, height), Image.Resampling.LANCZOS))


@pytest.mark.parametrize(("protocol", "decoded"), [(Protocol.KITTY, kitty_png), (Protocol.ITERM2, iterm2_png)])
def test_a_png_comes_through(protocol: Protocol, decoded: Callable[[bytes], bytes]) -> None:
    png = image_file.png(_noise(60, 90))
    assert len(png) > 3 * 4096, "several chunks"
    assert decoded(encode_picture(png, protocol, TerminalSize(80))) == png
    small = image_file.png(_noise(1, 1))
    assert decoded(encode_picture(small, protocol, TerminalSize(80))) == small


@pytest.mark.parametrize(("protocol", "decoded"), [(Protocol.KITTY, kitty_png), (Protocol.ITERM2, iterm2_png)])
def test_a_wide_picture_is_reduced_to_the_terminal(protocol: Protocol, decoded: Callable[[bytes], bytes]) -> None:
    image = _smooth(50, 1000)
    png = image_file.png(image)
    for size, width in ((TerminalSize(40), 360), (TerminalSize(40, 700), 700), (TerminalSize(200, 4000), 1000)):
        assert np.array_equal(pixels_of(decoded(encode_picture(png, protocol, size))), _reduced(image, width))


@pytest.mark.parametrize(("height", "width"), [(1, 1), (6, 5), (7, 300), (100, 33)])
def test_sixels_of_few_colors_are_the_pixels(height: int, width: int) -> None:
    palette = _noise(1, 12)[0]
    image = palette[np.random.default_rng(2).integers(0, 12, (height, width))]
    assert np.abs(sixel_pixels(encode_sixel(image)).astype(int) - image).max() <= PERCENT


def test_sixels_of_many_colors_are_near() -> None:
    image = _smooth(120, 200)
    shown = sixel_pixels(encode_picture(image_file.png(image), Protocol.SIXEL, TerminalSize(80)))
    assert np.abs(shown.astype(int) - image).mean() < 12


def test_sixels_have_run_lengths() -> None:
    white = np.full((600, 800, 3), 255, np.uint8)
    assert len(encode_sixel(white)) < 1500
    assert (sixel_pixels(encode_sixel(white)) == 255).all()


@pytest.mark.parametrize(("height", "width"), [(2, 1), (30, 20), (90, 80)])
def test_half_blocks_are_the_pixels(height: int, width: int) -> None:
    image = _noise(height, width)
    assert np.array_equal(block_pixels(encode_picture(image_file.png(image), Protocol.BLOCKS, TerminalSize(80))), image)


def test_half_blocks_of_a_wide_picture_are_reduced() -> None:
    image = _smooth(300, 500)
    shown = block_pixels(encode_picture(image_file.png(image), Protocol.BLOCKS, TerminalSize(50)))
    assert np.array_equal(shown, _reduced(image, 50))
    averages = image.reshape(30, 10, 50, 10, 3).mean(axis=(1, 3))
    near = np.abs(shown - averages)[1:-1, 1:-1, :2]  # inside, without the color that wraps around
    assert near.max() < 3


def test_an_odd_row_has_the_terminals_background() -> None:
    image = _noise(3, 4)
    shown = block_pixels(encode_half_blocks(image))
    assert np.array_equal(shown[:3], image)
    assert (shown[3] == (1, 2, 3)).all()


def test_equal_cells_set_their_color_once() -> None:
    line = encode_half_blocks(np.full((2, 50, 3), 7, np.uint8))
    assert line.count(b"38;2") == 1
    assert line.count("▀".encode()) == 50


def test_256_colors_are_the_nearest() -> None:
    image = np.concatenate(
        (_noise(40, 30), np.repeat(np.arange(256, dtype=np.uint8), 3).reshape(-1, 1, 3)[: 40 * 6 : 6].repeat(30, 1))
    )
    fixed = np.array([xterm(code) for code in range(16, 256)])
    best = np.linalg.norm(image[:, :, None].astype(float) - fixed, axis=-1).min(axis=-1)
    chosen = np.array([[xterm(int(code)) for code in row] for row in nearest_of_256(image)])
    mine = np.linalg.norm(image - chosen.astype(float), axis=-1)
    assert (mine - best).max() < 6, "grays are chosen by their mean"
    shown = block_pixels(encode_half_blocks(image, is_true_color=False))
    assert np.array_equal(shown[: len(image)], chosen)


def test_thin_lines_stay_visible_in_half_blocks() -> None:
    image = np.full((400, 800, 3), 255, np.uint8)
    image[199:201] = 0
    png = image_file.png(image)
    plain, widened = (
        block_pixels(encode_picture(png, Protocol.BLOCKS, TerminalSize(80), line_width=width)).min() for width in (0, 2)
    )
    assert plain > 150
    assert widened < 130, "between two rows of cells it is half as dark"
    kitty = encode_picture(png, Protocol.KITTY, TerminalSize(200), line_width=2)
    assert kitty_png(kitty) == png


def test_gray_and_transparent_pictures() -> None:
    for mode in ("L", "RGBA", "P"):
        file = io.BytesIO()
        Image.new(mode, (30, 20), 0).save(file, "PNG")
        for protocol in Protocol:
            assert encode_picture(file.getvalue(), protocol, TerminalSize(20, 25))


def test_same_bytes_every_time() -> None:
    png = image_file.png(_smooth(100, 1500))
    for protocol in Protocol:
        assert encode_picture(png, protocol, TerminalSize(70)) == encode_picture(png, protocol, TerminalSize(70))
