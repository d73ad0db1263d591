"""Materials of a source document as UsdPreviewSurface, and their binding to the faces of a USD mesh.

Texture coordinates are primvars st and st1, …, with v from the bottom. Metal and roughness come from one image, as
glTF packs them; an unlit material emits its base color.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Ints
from anim.caches.formats.texture_coordinates import texture_coordinates
from anim.caches.formats.usd_face_materials import DEFAULT_MATERIAL, face_materials
from anim.caches.formats.usd_stage import define_prims
from anim.caches.formats.usd_surface_inputs import TextureInput, constant_inputs, input_types, texture_inputs
from anim.caches.source_document.bake_source import BakedMesh, Span, baked_meshes
from anim.caches.source_document.checked_materials import find_item, find_material
from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Document, Json
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.materials import TRANSFORM, image_data
from anim.model import VertexCache

IMAGE_SUFFIXES = {b"\x89PNG": ".png", b"\xff\xd8\xff": ".jpg"}  # formats that every reader of USD knows
WRAP = {33071: "clamp", 33648: "mirror"}


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
        self._files: dict[tuple[int | None, str], str] = {}
        self._added, self._defined = set[int](), dict[int, Any]()

    def add_prims(self, numbers: Iterable[int]) -> None:
        """Make the prims of materials, which `define` fills, in one change."""
        new = [number for number in dict.fromkeys(numbers) if number not in self._added]
        if not new:
            return
        self._added.update(new)
        paths = [f"{self._scope}/{_material_name(number)}" for number in new]
        define_prims(
            self._stage, [each for path in paths for each in ((path, "Material"), (f"{path}/surface", "Shader"))]
        )

    def define(self, number: int) -> Any:
        """Return material `number` of the document, or glTF's default for -1, defined on its first use."""
        if number not in self._defined:
            self._defined[number] = self._define(number)
        return self._defined[number]

    def _define(self, number: int) -> Any:
        from pxr import Sdf, UsdShade

        about = find_material(self._document.json, number)
        path = Sdf.Path(f"{self._scope}/{_material_name(number)}")
        material = UsdShade.Material.Define(self._stage, path)
        if about.get("name"):
            material.GetPrim().SetDisplayName(about["name"])
        surface = UsdShade.Shader.Define(self._stage, path.AppendChild("surface"))
        surface.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
        kinds = input_types(Sdf)
        for name, value in constant_inputs(about).items():
            surface.CreateInput(name, kinds[name]).Set(value)
        nodes: dict[str, Any] = {}
        for each in texture_inputs(about):
            file = self._image(each, number)
            if file:
                self._connect(path, surface, each, file, kinds, nodes)
        return material

    def note_losses(self, primitives: Iterable[Json]) -> None:
        """Note vertex colors and scales of normal maps, which UsdPreviewSurface does not have."""
        listed = list(primitives)
        used = [find_material(self._document.json, each.get("material")) for each in listed]
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

    def _image(self, each: TextureInput, material: int) -> str:
        """Path of the file of a texture's image; "" with a note if USD can't show it.

        An image in two color spaces becomes two files, since Blender has one color space for a file.
        """
        source: int | None = find_item(self._document.json, "textures", each.info.get("index")).get("source")
        if (source, each.space) in self._files:
            return self._files[source, each.space]
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
        is_second = any(number == source for number, _ in self._files)
        path = self._save_image(source, f"-{each.space.lower()}{ending}" if is_second else ending, data)
        if path != path.encode(errors="replace").decode():  # bytes that are no text
            raise UnsupportedError("an image beside it has a name that is no UTF-8, as names in USD are")
        self._files[source, each.space] = path
        return path


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
    about = [find_material(document.json, each.get("material", DEFAULT_MATERIAL)) for each, _ in primitives]
    materials.note_losses(each for each, _ in primitives)
    mesh.CreateDoubleSidedAttr(any(each.get("doubleSided", False) for each in about))
    shown = face_materials(document.json, faces, primitives)
    materials.add_prims(shown.numbers)
    defined = [materials.define(number) for number in shown.numbers]
    if len(defined) <= 1:
        for material in defined:
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
        return
    names = [_material_name(number) for number in shown.numbers]
    define_prims(mesh.GetPrim().GetStage(), [(f"{mesh.GetPath()}/{name}", "GeomSubset") for name in names])
    for name, material, own in zip(names, defined, shown.faces, strict=True):
        rows, family = Vt.IntArray.FromNumpy(own.astype(np.int32)), UsdShade.Tokens.materialBind
        subset = UsdGeom.Subset.CreateGeomSubset(mesh, name, UsdGeom.Tokens.face, rows, family)
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)
    UsdShade.MaterialBindingAPI(mesh.GetPrim()).SetMaterialBindSubsetsFamilyType(UsdGeom.Tokens.partition)


def _material_name(number: int) -> str:
    return f"material{number}" if number >= 0 else "default_material"


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
    infos = [each.info for each in texture_inputs(find_material(json, primitive.get("material")))]
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
        found = texture_coordinates(primitive, number, accessors, span[1] - span[0])
        if found is not None:
            rows[slice(*span)] = found
            rows[slice(*span), 1] = 1 - rows[slice(*span), 1]
    kind, vertex = Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(st_name(number), kind, vertex).Set(Vt.Vec2fArray.FromNumpy(rows))
