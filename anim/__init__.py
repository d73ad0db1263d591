"""glTF 2.0 animation as immutable values and pure functions: the library of the command `gltf-anim`.

    import anim
    from anim import ops

    asset = anim.load("walk.glb")                  # path, bytes or binary file; .glb or .gltf
    asset.clips["walk"], asset.clips[0]            # Clip: name, tracks, start and end in seconds
    asset.skeleton, asset.scene                    # nodes in their rest pose; meshes, skins
    asset = asset.map_clips(lambda clip: ops.resample(clip, fps=30), clips="run*")
    anim.save(asset, "out.glb")                    # or .gltf, with its .bin beside it

    anim.optimize(asset, max_error="0.5mm").save("small.glb")
    anim.bake(asset, "walk", method="dqs", fps=24).save("walk.usdc")
    anim.diff("walk.glb", "small.glb").max_error   # m
    anim.sample(asset, "walk", fps=30)             # positions of all joints, (frames, nodes, 3)
    anim.page(asset, "small.glb")                  # bytes of an HTML page; in notebooks assets show theirs

Facade
    load, save              files and bytes ↔ Asset
    optimize, bake          fewer bytes within an error bound; skinning as a vertex cache
    diff                    distances between the motion of two assets
    sample, sample_poses    positions of joints; rotations, scales and matrices too
    page                    one HTML file that plays an asset or a cache, or compares two
    Asset, Clip, Track, Skeleton, Scene, VertexCache    their arguments and results
    AnimError               base of all errors: FormatError, UnsupportedError, NotFoundError,
                            RangeError, ShapeError, OutputError
    CACHE_FORMATS, SKINNING_METHODS, EASINGS, TANGENTS  tables of names for options
    ops                     Clip → Clip: resample, ease, warp, retime, trim, loop, spline

Packages, from the bottom up, each imported as anim.<package>.<module>
    maths                   quaternions, matrices, Euler angles, Hermite cubics on arrays
    model                   Clip, Track, TimeAxis, Skeleton, Scene, Pose, VertexCache: frozen, checked once
    files, gltf             paths; the JSON and buffers of glTF: reading, validation, writing
    sampling, curves        tracks and poses at times; easings, tangents, keys that follow curves
    measure                 inspect, error, diff, continuity, loops
    operations              implementation of `ops`
    exchange                BVH, CSV and JSON curves; retargeting
    skinning, caches        methods and bakes; .npz, .usdc, .pc2, .glb and other vertex caches
    optimization            fewest keys and bits within an error bound, verified
    simulation              particles, springs, cloth and rigid bodies, and the integrators behind them
    show                    plots, filmstrips, pages
    check                   rules about files, their fixes, baselines and budgets

Metres, seconds and radians; right-handed, Y up; quaternions (x, y, z, w). Arrays are read-only, so that values can be
shared: `values.copy()` gives one to write to.
"""

# No imports here: until the command has set its handlers of signals, Ctrl-C shows where Python was.
TYPE_CHECKING = False  # type checkers take it for true

if TYPE_CHECKING:
    from anim import ops as ops
    from anim.api import OptimizeResult as OptimizeResult
    from anim.api import bake as bake
    from anim.api import diff as diff
    from anim.api import optimize as optimize
    from anim.api import sample as sample
    from anim.api import sample_poses as sample_poses
    from anim.asset import Asset as Asset
    from anim.asset import load as load
    from anim.asset import save as save
    from anim.asset_page import page as page
    from anim.baked_cache import BakedCache as BakedCache
    from anim.caches.registry import CACHE_FORMATS as CACHE_FORMATS
    from anim.curves.easing.table import EASINGS as EASINGS
    from anim.curves.tangents.table import TANGENTS as TANGENTS
    from anim.errors import AnimError as AnimError
    from anim.errors import FormatError as FormatError
    from anim.errors import NotFoundError as NotFoundError
    from anim.errors import OutputError as OutputError
    from anim.errors import RangeError as RangeError
    from anim.errors import ShapeError as ShapeError
    from anim.errors import UnsupportedError as UnsupportedError
    from anim.model import Clip as Clip
    from anim.model import Interpolation as Interpolation
    from anim.model import Scene as Scene
    from anim.model import Skeleton as Skeleton
    from anim.model import TimeAxis as TimeAxis
    from anim.model import Track as Track
    from anim.model import VertexCache as VertexCache
    from anim.skinning.methods.registry import SKINNING_METHODS as SKINNING_METHODS

__version__ = "0.2.0"

_MODULES = {  # modules of the names, imported on first use
    "anim.api": ("OptimizeResult", "bake", "diff", "optimize", "sample", "sample_poses"),
    "anim.asset": ("Asset", "load", "save"),
    "anim.asset_page": ("page",),
    "anim.baked_cache": ("BakedCache",),
    "anim.caches.registry": ("CACHE_FORMATS",),
    "anim.curves.easing.table": ("EASINGS",),
    "anim.curves.tangents.table": ("TANGENTS",),
    "anim.errors": (
        "AnimError",
        "FormatError",
        "NotFoundError",
        "OutputError",
        "RangeError",
        "ShapeError",
        "UnsupportedError",
    ),
    "anim.model": ("Clip", "Interpolation", "Scene", "Skeleton", "TimeAxis", "Track", "VertexCache"),
    "anim.skinning.methods.registry": ("SKINNING_METHODS",),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}
__all__ = [*_HOMES, "ops"]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name == "ops":
        return import_module("anim.ops")
    if name not in _HOMES:
        raise AttributeError(f"module 'anim' has no attribute '{name}'")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
