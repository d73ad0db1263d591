"""Documents to embed, and what is in them."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

from PIL import Image

from anim.gltf.document import Document, copy_json
from tests.files import opened, opened_fixture

MARKUP = "</script><script>alert(1)</script>"


Json = dict[str, Any]


def png_of(color: tuple[int, int, int] = (200, 30, 30)) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (2, 2), color).save(file, "PNG")
    return file.getvalue()


def edited(name: str, **parts: Any) -> Document:
    document = opened_fixture(name)
    return replace(document, json={**copy_json(document.json), **parts})


def content_of(glb: bytes) -> Json:
    return opened(glb).json
