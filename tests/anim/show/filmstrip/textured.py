"""A square with a material, and its colors as rendered."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from anim.gltf.document import Document
from anim.show.filmstrip import clips
from anim.show.filmstrip.filmstrip import Extent, ViewOptions, filmstrip
from anim.show.filmstrip.frame_selection import FrameSelection
from fixtures.broken.pieces import FLOAT32, UINT8, buffered, text
from tests.files import opened

REPEAT, CLAMP, MIRROR, NEAREST = 10497, 33071, 33648, 9728
RED, GREEN, BLUE, YELLOW, WHITE = (255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255), (255, 255, 0, 255), (255,) * 4

FOUR = [[RED, GREEN], [BLUE, YELLOW]]
CORNERS = [[-1, 2, 0], [1, 2, 0], [-1, 0, 0], [1, 0, 0]]  # top left, top right, bottom left, bottom right
UV = [[0, 0], [1, 0], [0, 1], [1, 1]]
FRONT = ViewOptions(height=128, azimuth=0, elevation=0)


def encoded(texels: ArrayLike, form: str = "PNG", mode: str = "RGBA") -> bytes:
    """The bytes of an image file."""
    out = io.BytesIO()
    Image.fromarray(np.asarray(texels, np.uint8)).convert(mode).save(out, form)
    return out.getvalue()


def data_uri(data: bytes, media: str = "image/png") -> str:
    return f"data:{media};base64,{base64.b64encode(data).decode()}"


def square(
    texels: ArrayLike = FOUR,
    *,
    material: dict[str, Any] | None = None,
    info: dict[str, Any] | None = None,
    uv: ArrayLike = UV,
    colors: ArrayLike | None = None,
    files: dict[str, bytes] | None = None,
    **parts: Any,
) -> Document:
    """A square in the plane z = 0 that looks at +Z, with a texture as large as itself."""
    arrays: list[Any] = [("VEC3", FLOAT32, CORNERS), ("VEC2", FLOAT32, uv), ("SCALAR", UINT8, [0, 2, 1, 1, 2, 3])]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    if colors is not None:
        arrays.append((f"VEC{np.shape(colors)[1]}", FLOAT32, colors))
        attributes["COLOR_0"] = 3
    surface = {"baseColorTexture": {"index": 0, **(info or {})}, **(material or {}).pop("pbr", {})}
    content = buffered(*arrays) | {
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": surface, **(material or {})}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": NEAREST}],
        "images": [{"uri": data_uri(encoded(texels))}],
    }
    return opened(text(content | parts), files)


def picture(document: Document, notes: list[str] | None = None, **options: Any) -> Any:
    """The picture of a file from the front."""
    note = (lambda words: None) if notes is None else notes.append
    rows, extent = clips.build_strips(
        clips.of_document(document, [], (), FrameSelection(count=1), note=note, **options)
    )
    return filmstrip(rows, Extent(extent.points, extent.ground), look=FRONT)


def seen(document: Document, notes: list[str] | None = None, *, reach: float = 0.2, **options: Any) -> list[str]:
    """Names of the colors in the middles of the four quarters of the square: top left, top right, then below.

    reach: how far from the middle they are, in heights of the picture.
    """
    image = picture(document, notes, **options)
    places = [
        (12 + round(128 * y), image.shape[1] // 2 + round(128 * x))
        for y in (0.5 - reach, 0.5 + reach)
        for x in (-reach, reach)
    ]
    return [named(image[place].astype(int)) for place in places]


def named(pixel: Any) -> str:
    r, g, b = pixel
    if max(pixel) < 40:
        return "black"
    is_on = tuple(each > max(pixel) * 0.5 for each in (r, g, b))
    names = {(True, False, False): "red", (False, True, False): "green", (False, False, True): "blue"}
    return {**names, (True, True, False): "yellow", (True, True, True): "gray"}.get(is_on, str(pixel))
