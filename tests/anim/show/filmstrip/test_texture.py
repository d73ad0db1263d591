"""Textures: wrapping, interpolation, perspective, decoding."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from anim.errors import FormatError
from anim.show.filmstrip import texture
from anim.show.filmstrip.texture import TextureSampler, decode_image
from tests.anim.show.filmstrip.textured import CLAMP, GREEN, MIRROR, RED, REPEAT, YELLOW, encoded


@pytest.mark.parametrize(
    ("mode", "expected"),
    [(REPEAT, "aabbaabbaabb"), (CLAMP, "aaaaaabbbbbb"), (MIRROR, "bbaaaabbbbaa"), (None, "aabbaabbaabb")],
)
def test_wrap_modes(mode: int | None, expected: str) -> None:
    texels = np.array([[[0, 0, 0, 255], [255, 255, 255, 255]]], np.uint8)
    u = np.arange(-1, 2, 0.25) + 0.125
    found = TextureSampler(texels, (mode or 0, CLAMP), nearest=True).sample(np.stack((u, u), axis=1))
    assert "".join("ab"[round(each)] for each in found[:, 0]) == expected


def test_texels_are_interpolated_in_linear_light() -> None:
    texels = np.array([[[0, 0, 0, 0], [255, 255, 255, 255]]], np.uint8)
    places = np.array([[0.25, 0.5], [0.5, 0.5], [0.75, 0.5], [0.0, 0.5]])
    found = TextureSampler(texels, (REPEAT, REPEAT)).sample(places)
    assert found[:, 0] == pytest.approx([0, 0.5, 1, 0.5])
    assert found[:, 3] == pytest.approx([0, 0.5, 1, 0.5])


def test_textures_are_in_perspective() -> None:
    """Seen at a slant, the middle of the square is where its diagonals meet, not half way on the screen."""
    from anim.show.filmstrip.surface import Coating, Surface

    sampler = TextureSampler(np.array([[RED, GREEN]], np.uint8), (CLAMP, CLAMP), nearest=True)
    faces = np.array([[0, 1, 2]])
    surface = Surface(faces, np.zeros(1, int), (Coating(sampler),), np.array([[0.0, 0], [1, 0], [1, 0]]), None)
    corners = np.array([[[0, 0, 1.0], [10, 0, 1 / 3], [10, 1, 1 / 3]]])  # three times as far on the right
    x = np.array([7.4, 7.6])  # half of the way in space is at 3/4 on the screen
    tint = surface.tint(corners, np.stack((x, x * 0.01), axis=1), np.zeros(2, int))
    assert tint.argmax(axis=1).tolist() == [0, 1]


@pytest.mark.parametrize(
    ("form", "mode"), [("PNG", "RGB"), ("PNG", "L"), ("PNG", "P"), ("JPEG", "RGB"), ("WEBP", "RGBA")]
)
def test_images_are_decoded(form: str, mode: str) -> None:
    found = decode_image(np.frombuffer(encoded(np.full((9, 7, 4), 200), form, mode), np.uint8))
    assert found.shape == (9, 7, 4)
    assert np.abs(found[..., :3].astype(int) - 200).max() <= 4


def test_gray_levels_of_16_bits_are_scaled() -> None:
    data = io.BytesIO()
    Image.fromarray(np.array([[0, 128, 32768, 65535]], np.uint16)).save(data, "PNG")
    found = decode_image(np.frombuffer(data.getvalue(), np.uint8))
    assert found[0, :, 0].tolist() == [0, 0, 128, 255]
    assert (found[..., :3] == found[..., :1]).all()
    assert (found[..., 3] == 255).all()


@pytest.mark.parametrize("form", ["PNG", "JPEG"])
def test_large_images_are_reduced(form: str) -> None:
    texels = np.zeros((600, 3000, 4), np.uint8) + np.array(YELLOW, np.uint8)
    found = decode_image(np.frombuffer(encoded(texels, form, "RGB"), np.uint8))
    assert max(found.shape[:2]) <= 1024
    assert found.shape[1] / found.shape[0] == pytest.approx(5, rel=0.02)
    assert np.abs(found.astype(int) - YELLOW).max() <= 4


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is no PNG, JPEG or WebP"),
        (b"GIF89a" + bytes(50), "is no PNG, JPEG or WebP"),
        (b"\xabKTX 20\xbb" + bytes(50), "is no PNG, JPEG or WebP"),
        (encoded(np.full((64, 64, 4), 9))[:-40], "can't be decoded"),
        (encoded(np.full((64, 64, 4), 9))[:40], "that can be decoded"),
    ],
)
def test_what_is_no_image_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(FormatError, match=words):
        decode_image(np.frombuffer(data, np.uint8))


def test_damaged_images_are_never_a_crash() -> None:
    random = np.random.default_rng(5)
    for form in ("PNG", "JPEG", "WEBP"):
        whole = np.frombuffer(encoded(random.integers(0, 256, (20, 20, 4)), form, "RGB"), np.uint8)
        for _ in range(60):
            broken = whole.copy()
            broken[random.integers(0, len(whole), 3)] = random.integers(0, 256, 3)
            try:
                decode_image(broken)
            except FormatError:
                continue


def test_images_of_many_pixels_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    data = np.frombuffer(encoded(np.zeros((90, 90, 4))), np.uint8)
    monkeypatch.setattr(texture, "FREE_PIXELS", 8100)
    monkeypatch.setattr(texture, "PIXELS_PER_BYTE", 1)
    budget = texture.PixelBudget()
    decode_image(data, budget)
    with pytest.raises(FormatError, match=r"has 90 × 90 pixels .*for images of so few bytes"):
        decode_image(data, budget)
    monkeypatch.setattr(texture, "MAX_PIXELS", 8000)
    with pytest.raises(FormatError, match="has 90 × 90 pixels"):
        decode_image(data)


@pytest.mark.parametrize("mode", ["L", "RGB", "RGBA", "P", "LA", "1"])
def test_reduced_images_are_the_average_of_their_pixels(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(texture, "MAX_SIDE", 4)
    pixels = np.random.default_rng(3).integers(0, 256, (8, 8, 4))
    data = np.frombuffer(encoded(pixels, "PNG", mode), np.uint8)
    expected = Image.open(io.BytesIO(data.tobytes())).convert("RGBA")
    expected.thumbnail((4, 4))
    np.testing.assert_allclose(decode_image(data).astype(int), np.array(expected).astype(int), atol=1)


@pytest.mark.parametrize("mode", ["L", "RGB"])
def test_a_transparent_color_is_no_part_of_the_average(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(texture, "MAX_SIDE", 2)
    image = Image.new(mode, (4, 4), 0)
    image.paste(200 if mode == "L" else (200, 200, 200), (0, 0, 1, 4))
    out = io.BytesIO()
    image.save(out, "PNG", transparency=0 if mode == "L" else (0, 0, 0))
    left, right = decode_image(np.frombuffer(out.getvalue(), np.uint8))[0].tolist()
    assert left[:3] == [200, 200, 200]
    assert 100 < left[3] < 156
    assert right[3] == 0
