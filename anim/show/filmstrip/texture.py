"""Textures: images decoded by Pillow, sampled at glTF texture coordinates (origin at the top left)."""

from __future__ import annotations

import io
import struct
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Bytes, Floats, Ints
from anim.errors import FormatError
from anim.gltf.reading.materials import CLAMP_TO_EDGE, MIRRORED_REPEAT
from anim.show.filmstrip.renderer import GAMMA

if TYPE_CHECKING:
    from PIL import Image

MAX_SIDE = 1024  # texels; larger images are reduced, since frames have a few hundred pixels
MAX_PIXELS = 1 << 27  # of an image in the file
FREE_PIXELS = 1 << 25  # of all images of a file, and as many per encoded byte as good compression has
PIXELS_PER_BYTE = 32
DECODER_ERRORS = (OSError, ValueError, SyntaxError, EOFError, IndexError, struct.error)  # errors of decoders
REDUCIBLE = ("L", "RGB", "RGBA")  # modes in which Pillow averages pixels; a conversion of all of them takes memory
FORMATS = ("PNG", "JPEG", "WEBP")
LINEAR = ((np.arange(256) / 255) ** GAMMA).astype(np.float32)  # linear light of each byte, the inverse of `to_srgb`
GRAY_16 = 65535  # largest gray level of 16-bit PNG

Texels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class TextureSampler:
    """Texels (H, W, 4) as stored, RGB in sRGB. wrap: modes along u and v. nearest: no interpolation."""

    texels: Texels
    wrap: tuple[int, int]
    nearest: bool = False

    def sample(self, texcoords: Floats) -> Floats:
        """Return linear RGBA (S, 4) at texture coordinates (S, 2): u to the right, v down, 1 the whole image."""
        height, width = self.texels.shape[:2]
        places = texcoords * (width, height) - (0.0 if self.nearest else 0.5)
        corner = np.floor(places)
        fractions = (places - corner).astype(np.float32)
        x, y = (corner[:, i].astype(np.int64) for i in (0, 1))
        if self.nearest:
            return self._fetch(x, y).astype(np.float64)
        right, down = fractions[:, :1], fractions[:, 1:]
        top = self._fetch(x, y) * (1 - right) + self._fetch(x + 1, y) * right
        bottom = self._fetch(x, y + 1) * (1 - right) + self._fetch(x + 1, y + 1) * right
        return np.asarray(top * (1 - down) + bottom * down, np.float64)

    def _fetch(self, x: Ints, y: Ints) -> NDArray[np.float32]:
        height, width = self.texels.shape[:2]
        found = self.texels[_wrap(y, height, self.wrap[1]), _wrap(x, width, self.wrap[0])]
        rgba = LINEAR[found]
        rgba[:, 3] = found[:, 3] / np.float32(255)
        return rgba


class PixelBudget:
    """Pixels that the images of a file may still have, decoded: a few bytes can say that they are many."""

    def __init__(self) -> None:
        self._left = FREE_PIXELS

    def take(self, width: int, height: int, size: int) -> None:
        """Count an image of `size` encoded bytes. Raises FormatError if it has too many pixels."""
        left = self._left + PIXELS_PER_BYTE * size
        limit = min(left, MAX_PIXELS)
        if width * height > limit:
            raise FormatError(
                f"has {width} × {height} pixels (limit {limit / 1e6:.3g} million for images of so few bytes)"
            )
        self._left = left - width * height


def decode_image(data: Bytes, budget: PixelBudget | None = None) -> Texels:
    """Return the texels (H, W, 4) of an encoded image, reduced where it has more than 1024 on a side.

    budget: of all images of the file. Raises FormatError for data that is no PNG, JPEG or WebP, damaged images, and
    too many pixels.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of sizes (checked below) and of odd metadata
            image = Image.open(io.BytesIO(data.tobytes()), formats=FORMATS)
            (budget or PixelBudget()).take(image.width, image.height, len(data))
            image.draft("RGB", (MAX_SIDE, MAX_SIDE))
            pixels = _as_bytes(image)
            if pixels.mode not in REDUCIBLE or "transparency" in image.info:  # a color that is transparent
                pixels = pixels.convert("RGBA")
            pixels.thumbnail((MAX_SIDE, MAX_SIDE))
            return np.array(pixels.convert("RGBA"))
    except Image.UnidentifiedImageError:
        raise FormatError(f"is no PNG, JPEG or WebP that can be decoded (starts with {data[:8].tobytes()!r})") from None
    except (*DECODER_ERRORS, Image.DecompressionBombError) as error:
        raise FormatError(f"can't be decoded ({str(error).lower()})") from None


def _as_bytes(image: Image.Image) -> Image.Image:
    """The image with 8 bits per channel; Pillow's conversion clips gray levels of 16 bits."""
    from PIL import Image

    if not image.mode.startswith("I"):
        return image
    return Image.fromarray((np.asarray(image).astype(np.int64) / GRAY_16 * 255).round().clip(0, 255).astype(np.uint8))


def _wrap(index: Ints, size: int, mode: int) -> Ints:
    """Indices within 0 … size − 1; an unknown mode counts as REPEAT."""
    if mode == CLAMP_TO_EDGE:
        return np.clip(index, 0, size - 1)
    if mode == MIRRORED_REPEAT:
        index = index % (2 * size)
        return np.minimum(index, 2 * size - 1 - index)
    return index % size
