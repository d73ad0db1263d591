"""Options of the commands that read or write vertex caches, and their settings."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated, Any

import typer

from anim.caches.formats import gltf
from anim.caches.options import MAX_TARGETS, WriteOptions
from anim.caches.registry import CACHE_FORMATS
from anim.caches.transforms import vertex_order
from anim.caches.transforms.up_axis import UPS
from anim.caches.vat import presets
from cli.errors import UsageError

FORMATS = ", ".join(CACHE_FORMATS)
VECTOR_OPTIONS = {"normals": "--normals", "tangents": "--vertex-tangents"}

Up = StrEnum("Up", [(up, up) for up in UPS])  # type: ignore[misc]
Order = StrEnum("Order", [(name, name) for name in vertex_order.ORDERS])  # type: ignore[misc]
Layout = StrEnum("Layout", [(name, name) for name in gltf.LAYOUTS])  # type: ignore[misc]
Preset = StrEnum("Preset", [(name, name) for name in presets.PRESETS])  # type: ignore[misc]
Format = StrEnum("Format", [(ending[1:], ending[1:]) for ending in CACHE_FORMATS])  # type: ignore[misc]


class Depth(StrEnum):
    """Channel type of an EXR."""

    FLOAT = "float"
    HALF = "half"


class RestMesh(StrEnum):
    """The rest mesh beside a PC2 or MDD."""

    PLY = "ply"
    OBJ = "obj"
    NONE = "none"


Product = Annotated[str, typer.Argument(metavar="OUT", help=f"A cache: {FORMATS}; '-' for stdout.", show_default=False)]
UpOption = Annotated[Up | None, typer.Option("--up", help="Up axis; z for Blender.", show_default=False)]
VertexOrderOption = Annotated[
    Order | None,
    typer.Option(
        "--vertex-order",
        help="Vertex order: of the file, or of Blender's glTF importer, which drops unused vertices.",
        show_default=False,
    ),
]
FormatOption = Annotated[
    Format | None,
    typer.Option(
        "--format",
        help="Output format (default: from the extension, npz for '-'); a conflicting extension is an error.",
        show_default=False,
    ),
]
MaxError = Annotated[
    str | None,
    typer.Option(
        "--max-error", metavar="LENGTH", help="Morph targets: maximum vertex error, 0.5mm or 0.1%, default 0.1%."
    ),
]
MaxTargets = Annotated[
    int | None,
    typer.Option(
        "--max-targets",
        metavar="N",
        min=1,
        help=f"Morph targets: at most N, default {MAX_TARGETS}, which WebGL2, bevy and Filament support.",
        show_default=False,
    ),
]
KeepSkeleton = Annotated[
    bool, typer.Option("--keep-skeleton", help=".glb: keep skins, and the channels of joints.", show_default=False)
]
Quantize = Annotated[bool, typer.Option("--quantize", help="Morph targets as 16-bit integers.")]
LayoutOption = Annotated[
    Layout | None,
    typer.Option(
        "--layout", help=".glb: morph targets (default; up to 1 GB of positions) or a flip-book.", show_default=False
    ),
]
PresetOption = Annotated[
    Preset | None, typer.Option("--preset", help="Textures: target engine; default plain.", show_default=False)
]
DepthOption = Annotated[
    Depth | None, typer.Option("--depth", help=".exr: float (default) or half.", show_default=False)
]
RestMeshOption = Annotated[
    RestMesh | None,
    typer.Option("--rest-mesh", help=".pc2, .mdd: format of the companion rest mesh, default ply.", show_default=False),
]


def write_options(ending: str, given: Mapping[str, Any]) -> WriteOptions:
    """Return the write options of a format from command line options (None, False: not given).

    given: values by option; `onto` is checked only, and `source` is the document.
    Raises UsageError for an option that the format doesn't support.
    """
    takes = CACHE_FORMATS[ending].takes
    said: dict[str, Any] = {name: value for name, value in given.items() if value not in (None, False)}
    for name in said:
        if ("source" if name == "onto" else name) not in takes:
            raise UsageError(f"--{name.replace('_', '-')} does not apply to {ending}")
    if "max_error" in said and str(said.get("layout", "")).startswith("flip"):
        raise UsageError("--max-error does not apply to a flip-book, which stores every frame exactly")
    if "max_targets" in said and str(said.get("layout", "")).startswith("flip"):
        raise UsageError("--max-targets does not apply to a flip-book")
    if "rest_mesh" in said:
        said["rest_mesh"] = "" if said["rest_mesh"] == "none" else f".{said['rest_mesh']}"
    said.pop("onto", None)
    plain: dict[str, Any] = {name: str(value) if isinstance(value, StrEnum) else value for name, value in said.items()}
    return WriteOptions(**plain)


def formats_with(what: str) -> tuple[str, ...]:
    """Return the file extensions of the formats that store "normals" or "tangents"."""
    return tuple(ending for ending, format in CACHE_FORMATS.items() if what in format.holds)


def formats_with_materials(*, with_normals: bool = False) -> tuple[str, ...]:
    """Return the file extensions of the formats that take materials from the source; of those that show normals."""
    wanted = [ending for ending, format in CACHE_FORMATS.items() if "source" in format.takes]
    return tuple(each for each in wanted if not with_normals or "tangents" in CACHE_FORMATS[each].holds)


def check_supported(ending: str, **wanted: bool) -> None:
    """Raise UsageError for requested normals or tangents that the format can't store."""
    for what, is_wanted in wanted.items():
        if is_wanted and what not in CACHE_FORMATS[ending].holds:
            raise UsageError(
                f"{VECTOR_OPTIONS[what]} does not apply to {ending}",
                help=f"{', '.join(formats_with(what))} keep {what}",
            )
