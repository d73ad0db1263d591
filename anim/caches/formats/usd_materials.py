"""Materials of a source document as UsdPreviewSurface, and their binding to the faces of a USD mesh.

Texture coordinates are primvars st and st1, …, with v from the bottom. Metal and roughness come from one image, as
glTF packs them; an unlit material emits its base color.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Ints
from anim.caches.source_document.bake_source import BakedMesh, Span, baked_meshes
from anim.caches.source_document.lit_meshes import UNLIT, find_item
from anim.errors import FormatError
from anim.gltf.document import Document, Json
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.materials import DEFAULT_ALPHA_CUTOFF, TRANSFORM, image_data
from anim.model import VertexCache

EMISSIVE_STRENGTH = "KHR_materials_emissive_strength"
IMAGE_SUFFIXES = {b"\x89PNG": ".png", b"\xff\xd8\xff": ".jpg"}  # formats that every reader of USD knows
WRAP = {33071: "clamp", 33648: "mirror"}
WHITE = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class TextureInput:
    """An input of UsdPreviewSurface from channels of a texture: value = texel · scale + bias."""

    input: str
    channels: str
    info: Json
    space: str
    scale: tuple[float, ...] = WHITE
    bias: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


class UsdMaterials:
    """Materials of a document in a stage, below one scope.

    save_image: writes a file beside the stage: its index in the document, file extension and bytes → its path.
    note: called with a line for each texture that USD can't show.
    """

    def __init__(
        self,
        document: Document,
        stage: Any,
        scope: str,
        save_image: Callable[[int, str, bytes], str],
        note: Callable[[str], None],
    ) -> None:
        self._document, self._stage, self._scope, self._note = document, stage, scope, note
        self._accessors, self._save_image = Accessors(document), save_image
        self._files: dict[int, str] = {}
        self._defined: dict[int, Any] = {}

    def define(self, number: int) -> Any:
        """Return material `number` of the document, defined on its first use."""
        if number not in self._defined:
            self._defined[number] = self._define(number)
        return self._defined[number]

    def _define(self, number: int) -> Any:
        from pxr import Sdf, UsdShade

        about = find_item(self._document.json, "materials", number)
        path = Sdf.Path(f"{self._scope}/material{number}")
        material = UsdShade.Material.Define(self._stage, path)
        if about.get("name"):
            material.GetPrim().SetDisplayName(about["name"])
        surface = UsdShade.Shader.Define(self._stage, path.AppendChild("surface"))
        surface.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
        kinds = _input_types(Sdf)
        for name, value in _constants(about).items():
            surface.CreateInput(name, kinds[name]).Set(value)
        nodes: dict[str, Any] = {}
        for each in _textures(about):
            file = self._image(each.info, number)
            if file:
                self._connect(path, surface, each, file, kinds, nodes)
        return material

    def note_losses(self, primitives: Iterable[Json]) -> None:
        """Note vertex colors and scales of normal maps, which UsdPreviewSurface does not have."""
        listed = list(primitives)
        used = [find_item(self._document.json, "materials", each.get("material")) for each in listed]
        normals = [each.get("normalTexture", {}) for each in used]
        if any("COLOR_0" in each["attributes"] for each in listed):
            self._note("vertex colors are left out: UsdPreviewSurface does not have them")
        if any(each.get("scale", 1.0) != 1.0 for each in normals):
            self._note("the scale of normal maps is left out: UsdPreviewSurface does not have it")

    def _connect(self, path: Any, surface: Any, each: TextureInput, file: str, kinds: Any, nodes: Any) -> None:
        """Connect an input with its texture; inputs with the same values of one texture share a node."""
        from pxr import Sdf, UsdShade

        types = Sdf.ValueTypeNames
        shared = f"{each.info!r} {each.space} {each.scale} {each.bias}"
        texture = nodes.get(shared)
        if texture is None:
            texture = nodes[shared] = UsdShade.Shader.Define(self._stage, path.AppendChild(f"{each.input}_texture"))
            texture.CreateIdAttr("UsdUVTexture")
            texture.CreateInput("file", types.Asset).Set(Sdf.AssetPath(file))
            texture.CreateInput("sourceColorSpace", types.Token).Set(each.space)
            texture.CreateInput("scale", types.Float4).Set(each.scale)
            texture.CreateInput("bias", types.Float4).Set(each.bias)
            for name, mode in zip(("wrapS", "wrapT"), self._wrap(each.info), strict=True):
                texture.CreateInput(name, types.Token).Set(mode)
            coordinates = self._coordinates(path, each, nodes)
            texture.CreateInput("st", types.Float2).ConnectToSource(coordinates.ConnectableAPI(), "result")
        texture.CreateOutput(each.channels, types.Float3 if len(each.channels) == 3 else types.Float)
        surface.CreateInput(each.input, kinds[each.input]).ConnectToSource(texture.ConnectableAPI(), each.channels)

    def _coordinates(self, path: Any, each: TextureInput, nodes: Any) -> Any:
        """The node of the texture's coordinates: a reader of the primvar, and KHR_texture_transform behind it."""
        from pxr import Sdf, UsdShade

        types = Sdf.ValueTypeNames
        transform = each.info.get("extensions", {}).get(TRANSFORM)
        name = st_name(_coordinate_set(each.info))
        reader = nodes.get(name)
        if reader is None:
            reader = nodes[name] = UsdShade.Shader.Define(self._stage, path.AppendChild(name))
            reader.CreateIdAttr("UsdPrimvarReader_float2")
            reader.CreateInput("varname", types.String).Set(name)
            reader.CreateOutput("result", types.Float2)
        if not transform:
            return reader
        node = UsdShade.Shader.Define(self._stage, path.AppendChild(f"{each.input}_transform"))
        node.CreateIdAttr("UsdTransform2d")
        node.CreateInput("in", types.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
        rotation, scale, translation = flipped_transform(transform)
        node.CreateInput("rotation", types.Float).Set(rotation)
        node.CreateInput("scale", types.Float2).Set(scale)
        node.CreateInput("translation", types.Float2).Set(translation)
        node.CreateOutput("result", types.Float2)
        return node

    def _wrap(self, info: Json) -> tuple[str, str]:
        texture = find_item(self._document.json, "textures", info.get("index"))
        sampler = find_item(self._document.json, "samplers", texture.get("sampler"))
        return WRAP.get(sampler.get("wrapS", 0), "repeat"), WRAP.get(sampler.get("wrapT", 0), "repeat")

    def _image(self, info: Json, material: int) -> str:
        """Path of the file of a texture's image; "" with a note if USD can't show it."""
        source: int | None = find_item(self._document.json, "textures", info.get("index")).get("source")
        if source in self._files:
            return self._files[source]
        try:
            is_there = find_item(self._document.json, "images", source)
            data = (
                b"" if source is None or not is_there else image_data(self._document, source, self._accessors).tobytes()
            )
            problem = "is neither PNG nor JPEG"
        except FormatError as error:
            data, problem = b"", str(error)
        ending = next((each for magic, each in IMAGE_SUFFIXES.items() if data.startswith(magic)), "")
        if not ending or source is None:
            self._note(f"a texture of material {material} is left out: {problem}")
            return ""
        self._files[source] = self._save_image(source, ending, data)
        return self._files[source]


def bind_materials(cache: VertexCache, document: Document, mesh: Any, materials: UsdMaterials) -> None:
    """Add texture coordinates to the mesh of a cache, and bind its faces to their materials."""
    meshes = baked_meshes(cache, document)
    bind_primitives(document, mesh, materials, cache.vertex_count, cache.faces, list(_primitives(document, meshes)))


def bind_primitives(
    document: Document,
    mesh: Any,
    materials: UsdMaterials,
    num_vertices: int,
    faces: Ints,
    primitives: Sequence[tuple[Json, Span]],
) -> None:
    """Add texture coordinates to a mesh, and bind its faces to their materials, in subsets if there are several.

    faces: (T, 3). primitives: of the document, each with its vertices, in their order.
    """
    from pxr import UsdGeom, UsdShade, Vt

    for number in sorted({number for each, _ in primitives for number in _coordinate_sets(document.json, each)}):
        _add_coordinates(document, mesh, primitives, number, num_vertices)
    used = [each.get("material", -1) for each, _ in primitives]
    about = [find_item(document.json, "materials", number) for number in used]
    materials.note_losses(each for each, _ in primitives)
    mesh.CreateDoubleSidedAttr(any(each.get("doubleSided", False) for each in about))
    starts = np.array([span[0] for _, span in primitives])
    owner: Ints = np.searchsorted(starts, faces[:, 0], side="right") - 1
    of_face = np.array(used)[owner] if len(owner) else np.empty(0, np.int64)
    numbers = sorted(set(of_face.tolist()) - {-1})
    defined = {number: materials.define(number) for number in numbers}
    if len(numbers) == 1 and (of_face == numbers[0]).all():
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(defined[numbers[0]])
        return
    for number in numbers:
        rows = Vt.IntArray.FromNumpy(np.flatnonzero(of_face == number).astype(np.int32))
        name, family = f"material{number}", UsdShade.Tokens.materialBind
        subset = UsdGeom.Subset.CreateGeomSubset(mesh, name, UsdGeom.Tokens.face, rows, family)
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(defined[number])
    if numbers:
        kind = UsdGeom.Tokens.partition if (of_face >= 0).all() else UsdGeom.Tokens.nonOverlapping
        UsdShade.MaterialBindingAPI(mesh.GetPrim()).SetMaterialBindSubsetsFamilyType(kind)


def st_name(number: int) -> str:
    """Return the name of the primvar of TEXCOORD_n: st_name(0) → "st"."""
    return f"st{number or ''}"


def flipped_transform(transform: Json) -> tuple[float, tuple[float, float], tuple[float, float]]:
    """Return rotation in degrees, scale and translation of KHR_texture_transform for v from the bottom."""
    (x, y), (across, down) = transform.get("offset", (0, 0)), transform.get("scale", (1, 1))
    rotation = transform.get("rotation", 0)
    sine, cosine = math.sin(rotation), math.cos(rotation)
    return math.degrees(rotation), (across, down), (x + down * sine, 1 - down * cosine - y)


def _primitives(document: Document, meshes: Sequence[BakedMesh]) -> Iterator[tuple[Json, Span]]:
    """Primitives with vertices, and their vertices in the cache."""
    for each in meshes:
        for primitive, span in zip(document.json["meshes"][each.mesh]["primitives"], each.spans, strict=True):
            if span[0] < span[1]:
                yield primitive, span


def _coordinate_sets(json: Json, primitive: Json) -> set[int]:
    """Sets of texture coordinates that a primitive's material uses, and the first one."""
    infos = [each.info for each in _textures(find_item(json, "materials", primitive.get("material")))]
    wanted = {0, *map(_coordinate_set, infos)}
    return {each for each in wanted if f"TEXCOORD_{each}" in primitive["attributes"]}


def _coordinate_set(info: Json) -> int:
    return int(info.get("extensions", {}).get(TRANSFORM, {}).get("texCoord", info.get("texCoord", 0)))


def _add_coordinates(
    document: Document, mesh: Any, primitives: Sequence[tuple[Json, Span]], number: int, num_vertices: int
) -> None:
    from pxr import Sdf, UsdGeom, Vt

    accessors = Accessors(document)
    rows: AnyArray = np.zeros((num_vertices, 2), np.float32)
    for primitive, span in primitives:
        index = primitive["attributes"].get(f"TEXCOORD_{number}")
        if index is not None:
            rows[slice(*span)] = accessors.floats(index)
            rows[slice(*span), 1] = 1 - rows[slice(*span), 1]
    kind, vertex = Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(st_name(number), kind, vertex).Set(Vt.Vec2fArray.FromNumpy(rows))


def _input_types(sdf: Any) -> dict[str, Any]:
    types = sdf.ValueTypeNames
    numbers = dict.fromkeys(("metallic", "roughness", "opacity", "opacityThreshold", "occlusion"), types.Float)
    colors = dict.fromkeys(("diffuseColor", "emissiveColor"), types.Color3f)
    return {**numbers, **colors, "normal": types.Normal3f}


def _constants(about: Json) -> dict[str, Any]:
    """Inputs with one value; those with a texture too are replaced by its connection."""
    surface = about.get("pbrMetallicRoughness", {})
    color = tuple(surface.get("baseColorFactor", WHITE))
    found: dict[str, Any] = {"diffuseColor": color[:3], "emissiveColor": _emission(about)}
    if UNLIT in about.get("extensions", {}):
        found |= {"diffuseColor": (0.0, 0.0, 0.0), "emissiveColor": color[:3], "metallic": 0.0, "roughness": 1.0}
    else:
        found |= {"metallic": surface.get("metallicFactor", 1.0), "roughness": surface.get("roughnessFactor", 1.0)}
    mode = about.get("alphaMode", "OPAQUE")
    if mode != "OPAQUE":
        found["opacity"] = color[3]
    if mode == "MASK":
        found["opacityThreshold"] = about.get("alphaCutoff", DEFAULT_ALPHA_CUTOFF)
    return found


def _emission(about: Json) -> tuple[float, ...]:
    strength = about.get("extensions", {}).get(EMISSIVE_STRENGTH, {}).get("emissiveStrength", 1.0)
    return tuple(strength * each for each in about.get("emissiveFactor", (0.0, 0.0, 0.0)))


def _textures(about: Json) -> Iterator[TextureInput]:
    """Texture inputs of a material."""
    surface = about.get("pbrMetallicRoughness", {})
    is_unlit = UNLIT in about.get("extensions", {})
    color = tuple(surface.get("baseColorFactor", WHITE))
    if base := surface.get("baseColorTexture"):
        yield TextureInput("emissiveColor" if is_unlit else "diffuseColor", "rgb", base, "sRGB", color)
        if about.get("alphaMode", "OPAQUE") != "OPAQUE":
            yield TextureInput("opacity", "a", base, "sRGB", color)
    if is_unlit:
        return
    if packed := surface.get("metallicRoughnessTexture"):
        scale = (1.0, surface.get("roughnessFactor", 1.0), surface.get("metallicFactor", 1.0), 1.0)
        yield TextureInput("roughness", "g", packed, "raw", scale)
        yield TextureInput("metallic", "b", packed, "raw", scale)
    if normal := about.get("normalTexture"):
        yield TextureInput("normal", "rgb", normal, "raw", (2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0))
    if emissive := about.get("emissiveTexture"):
        yield TextureInput("emissiveColor", "rgb", emissive, "sRGB", (*_emission(about), 1.0))
    if occlusion := about.get("occlusionTexture"):
        strength = occlusion.get("strength", 1.0)
        yield TextureInput("occlusion", "r", occlusion, "raw", (strength,) * 4, (1.0 - strength,) * 4)
