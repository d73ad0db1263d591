"""Contents of a filmstrip: clips of a file by skinning method, or a cache, at chosen times."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import AnyArray, Bools, Floats, Ints
from anim.caches.transforms import resample, up_axis
from anim.errors import NotFoundError, RangeError
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf.document import Document
from anim.gltf.io.buffers import Resolve
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.materials import read_materials
from anim.model import Clip, Mesh, MeshInstance, Scene, Skeleton, VertexCache
from anim.show.filmstrip import palette, root_path
from anim.show.filmstrip.filmstrip import MAX_POINTS, Extent, Strip
from anim.show.filmstrip.frame_selection import FrameSelection
from anim.show.filmstrip.ground import ground_height
from anim.show.filmstrip.materials import MaterialReader
from anim.show.filmstrip.surface import Surface
from anim.skinning.bake import Baker, prepare_bake
from anim.skinning.methods.registry import SKINNING_METHODS

MAX_LOADED_BYTES = 48_000_000  # positions of frames that are baked once for all uses: of MAX_FRAMING_VERTICES
NUM_FRAMING_FRAMES = 48  # frames of the whole motion for the framing of the camera
BYTES_PER_FACE = 250  # corners on the screen twice, with colors
MIN_FRAMING_FRAMES = 8  # of these, of meshes with MAX_FRAMING_VERTICES in few frames
MAX_FRAMING_VERTICES = 4_000_000  # positions of all framing frames
STICK_CORNERS = np.array([0, 3, 2, 1, 7, 13])  # of 24: start, end and the ring
STICK_FACES = np.array([[0, 3 + i, 2 + i, 1, 2 + i, 3 + i] for i in range(3)] + [[0, 2, 5, 1, 5, 2]]).ravel()
CORNERS_PER_STICK_VERTEX = 4  # of a stick's faces at each vertex: thousands are framed by few frames
STICK_SCALE = 1.9  # width relative to the sticks in files
MAX_STICK_RATIO = 1.5  # relative to the median width, so that links to distant helper joints don't hide others


@dataclass(frozen=True, slots=True)
class FilmstripClip:
    """One motion. clip: its index in the file, −1 for none. name, method: for captions, or empty.

    cache: its chosen frames; path: some frames of the whole motion. colors: (T, 3) linear, of the faces. surface:
    materials that multiply them, or None. body: (V,) skinned vertices, or None if unknown.
    """

    clip: int
    name: str
    method: str
    cache: VertexCache
    path: VertexCache
    colors: Floats
    body: Bools | None = None
    surface: Surface | None = None


def of_document(
    document: Document,
    clips: Sequence[int],
    methods: Sequence[str],
    when: FrameSelection,
    *,
    scene: Scene | None = None,
    nodes: Collection[int] | None = None,
    textures: bool = True,
    resolve: Resolve | None = None,
    note: Callable[[str], None] = lambda _: None,
) -> list[FilmstripClip]:
    """Return the motion of each clip index and skinning method; without clips the rest pose.

    scene: the document's, if the caller has it. nodes: only meshes on these; None for all. A file without a mesh is
    shown as sticks from joint to joint. textures: show base color textures, vertex colors and alpha. resolve: gives
    the bytes of a companion file by its relative path, for images; None for input without a folder. note: called with
    notes on unsupported content. Raises NotFoundError for a file without meshes and joints.
    """
    for name in methods:
        if name not in SKINNING_METHODS:
            raise RangeError(f"`method` is '{name}' (expected {', '.join(SKINNING_METHODS)})")
    whole_scene = scene or reader.scene(document)
    scene = _visible(whole_scene, nodes)
    is_drawn = any(len(instance.mesh.faces) for instance in whole_scene.instances)
    materials = MaterialReader(document, resolve, note) if textures and is_drawn else None
    count = scene.vertex_count if is_drawn else CORNERS_PER_STICK_VERTEX * scene.vertex_count
    known = reader.clips(document)
    chosen = [(i, known[i]) for i in clips] or [(-1, Clip("", ()))]
    moving = [clip for _, clip in chosen if clip.tracks]
    surface: Surface | None = None
    colors: Floats = np.empty((0, 3))
    when.check(min((clip.start for clip in moving), default=0.0), max((clip.end for clip in moving), default=0.0))
    found: list[FilmstripClip] = []
    bakers: dict[str, Baker] = {}
    budget = Accessors(document).budget
    budget.add(BYTES_PER_FACE * sum(len(instance.mesh.faces) for instance in scene.instances))
    for number, clip in chosen:
        start, end = (clip.start, clip.end) if clip.tracks else (0.0, 0.0)
        times, path = when.times(start, end), _framing_times(start, end, count)
        if not len(times):
            continue
        for method in methods or ("lbs",):
            budget.add(12 * len(times) * scene.vertex_count)
            if method not in bakers:
                bakers[method] = prepare_bake(scene, method=method, rigid=True)
            cache = _load_small(bakers[method].bake(clip, times=times))
            is_same = np.array_equal(times, path)
            whole = cache if is_same else _load_small(bakers[method].bake(clip, times=path))
            if not found and materials is not None:
                surface, colors = materials.surface(cache)
            elif not found:
                colors = palette.face_colors(cache, _factors(document))
            kind = method if methods else ""
            found.append(FilmstripClip(number, clip.name, kind, cache, whole, colors, _body(scene, cache), surface))
    if not found:
        raise RangeError(f"no clip has a frame at {', '.join(f'{time:g} s' for time in when.at)}")
    return found


def _load_small(cache: VertexCache) -> VertexCache:
    """The cache with its frames in memory if they are small: they are used several times, and baked once."""
    if 12 * cache.frame_count * cache.vertex_count > MAX_LOADED_BYTES:
        return cache
    frames = cache.load_all()
    return replace(cache, chunks=lambda: iter((frames,)))


def of_cache(cache: VertexCache, when: FrameSelection) -> list[FilmstripClip]:
    """Return the motion of a cache. Raises NotFoundError if it has no faces."""
    if not len(cache.faces):
        raise NotFoundError("has no faces to draw", help="put the rest mesh beside it: NAME-rest.ply")
    cache = up_axis.to_up_axis(cache, "y")
    start, end = float(cache.times[0]), float(cache.times[-1])
    when.check(start, end)
    chosen = resample.resample_frames(cache, when.times(start, end))
    whole = resample.resample_frames(cache, _framing_times(start, end, cache.vertex_count))
    return [FilmstripClip(-1, "", "", chosen, whole, palette.face_colors(cache))]


def build_strips(
    shots: Sequence[FilmstripClip], *, heated: bool = False, followed: bool | None = None
) -> tuple[list[Strip], Extent]:
    """Return the rows of a filmstrip, and the extent for its camera.

    heated: color distances of vertices from the clip's first method, or from the rest pose for a single method. Raises
    NotFoundError if there is no rest pose.
    followed: whether the camera follows the figure; None to follow one that travels by more than its own size.
    """
    several_clips = len({shot.clip for shot in shots}) > 1
    found: list[Strip] = []
    points: list[AnyArray] = []
    first = shots[0]
    reference: AnyArray = np.empty(0)
    for i, shot in enumerate(shots):
        positions = shot.cache.load_all().positions
        if i == 0 or first.clip != shot.clip:
            first, reference = shot, positions
            is_followed = root_path.travels(shot.path) if followed is None else followed
            camera_path = root_path.root_path(shot.path) if is_followed else None
        alone = sum(other.clip == shot.clip for other in shots) == 1
        distances = _distances(shot, positions, reference, alone, shot is first) if heated else None
        heading = reader.clip_name(shot.name, shot.clip) if several_clips else ""
        cache = shot.cache
        found.append(
            Strip(
                shot.method,
                cache.times,
                positions,
                cache.faces,
                shot.colors,
                distances,
                heading,
                camera_path,
                cache.rest,
                shot.surface,
                shot.clip,
            )
        )
        points += [_framing_points(each, camera_path) for each in dict.fromkeys((shot.path, shot.cache))]
    ground = min(ground_height(each, shot.body) for shot in shots for each in dict.fromkeys((shot.path, shot.cache)))
    return found, Extent(np.concatenate(points), ground)


def _distances(
    shot: FilmstripClip, positions: AnyArray, reference: AnyArray, alone: bool, is_first: bool
) -> Floats | None:
    """Distances (F, V) m from the clip's first method, or of a single method from the rest pose."""
    if not alone:
        return None if is_first else palette.distances(positions, reference)
    if shot.cache.rest is None:
        raise NotFoundError("has no rest pose that distances could be measured from")
    return palette.distances(positions, shot.cache.rest)


def _body(scene: Scene, cache: VertexCache) -> Bools:
    """Mask (V,) of skinned vertices."""
    skinned = {instance.node for instance in scene.instances if instance.skin is not None}
    body = np.zeros(cache.vertex_count, bool)
    for part in cache.parts:
        body[slice(*part.vertices)] = part.node in skinned
    return body


def _visible(scene: Scene, nodes: Collection[int] | None) -> Scene:
    """The scene with the chosen meshes, or with sticks on its joints if it has no faces."""
    if nodes is not None:
        scene = replace(scene, instances=tuple(each for each in scene.instances if each.node in nodes))
        if not any(len(instance.mesh.faces) for instance in scene.instances):
            raise NotFoundError("no mesh is left to draw")
    if any(len(instance.mesh.faces) for instance in scene.instances):
        return scene
    if not len(scene.skeleton):
        raise NotFoundError("has neither a mesh nor a node to draw")
    mesh, skin = stick_mesh(scene.skeleton, _ends(scene.skeleton))
    if not len(mesh.positions):
        raise NotFoundError("has neither a mesh nor joints to draw")
    return Scene(scene.skeleton, (MeshInstance(0, _merge_corners(_widen_sticks(mesh)), skin, np.zeros(0)),))


def _widen_sticks(mesh: Mesh) -> Mesh:
    """Sticks of 24 corners (start, ring, ring, end, ring, ring, …) with wider rings, for small pictures."""
    bodies = mesh.positions.reshape(-1, 24, 3).copy()
    ring = np.array([1, 2, 4, 5, 7, 8, 10, 11, 13, 14, 16, 17, 19, 20, 22, 23])
    middle = (bodies[:, [1]] + bodies[:, [13]]) / 2  # opposite corners of the ring
    radius = np.linalg.norm(bodies[:, [1]] - middle, axis=-1, keepdims=True)
    wanted = STICK_SCALE * np.minimum(radius, MAX_STICK_RATIO * np.median(radius))
    bodies[:, ring] = middle + wanted / radius * (bodies[:, ring] - middle)
    return replace(mesh, positions=bodies.reshape(-1, 3))


def _merge_corners(mesh: Mesh) -> Mesh:
    """The same sticks on six vertices each, shared by their faces: pictures need no normals of vertices."""
    rows: Ints = np.arange(0, len(mesh.positions), 24)[:, None]
    chosen = (rows + STICK_CORNERS).ravel()
    faces = (rows // 24 * len(STICK_CORNERS) + STICK_FACES).reshape(-1, 3)
    none = np.zeros((0, len(chosen), 3))
    return Mesh(
        mesh.name, mesh.positions[chosen], faces, mesh.joints[chosen], mesh.weights[chosen], none, mesh.rest_weights
    )


def _ends(skeleton: Skeleton) -> frozenset[int]:
    """Nodes that only mark the end of their parent's stick: those without children."""
    parents = set(skeleton.parents.tolist())
    return frozenset(i for i in range(len(skeleton)) if i not in parents and skeleton.parents[i] >= 0)


def _factors(document: Document) -> list[tuple[float, float, float]]:
    """Base colors of the materials; white for textured ones, so that parts get palette colors."""
    materials = read_materials(document)
    return [(1.0, 1.0, 1.0) if each.texture is not None else each.factor[:3] for each in materials]


def _framing_times(start: float, end: float, vertices: int) -> Floats:
    """Times of the whole motion for the camera; fewer of many vertices, for memory."""
    count = min(max(MAX_FRAMING_VERTICES // max(vertices, 1), MIN_FRAMING_FRAMES), NUM_FRAMING_FRAMES)
    return np.linspace(start, end, count) if end > start else np.array([start])


def _framing_points(cache: VertexCache, camera_path: root_path.RootPath | None) -> AnyArray:
    """Vertices of all frames relative to the camera; of long motions a subset of frames."""
    step = max(1, -(-cache.frame_count * cache.vertex_count // MAX_POINTS))
    found = []
    for chunk in cache.chunks():
        chosen = slice(-chunk.first % step, None, step)
        positions = chunk.positions[chosen].copy()
        if camera_path is not None:
            times = cache.times[chunk.first : chunk.first + len(chunk.positions)][chosen]
            positions[..., [0, 2]] -= camera_path.at(times)[:, None]
        found.append(positions.reshape(-1, 3))
    return np.concatenate(found)
