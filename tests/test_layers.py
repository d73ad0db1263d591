"""Imports point one way, and only the command line talks to the outside."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from anim.skinning.kernels.jit import KERNEL_FOLDERS

ROOT = Path(__file__).resolve().parents[1]

# Packages from the bottom up; one may import from its own level only where NEIGHBORS says so.
LEVELS = (
    {"errors"},
    {"arrays", "memory", "units"},
    {"arguments", "maths", "files", "worker_processes"},
    {"model"},
    {"gltf", "sampling"},
    {"curves"},
    {"measure"},
    {"operations", "exchange", "skinning", "simulation", "caches", "optimization"},
    {"show", "check"},
    {"ops", "clip_list"},  # the facade, which `anim` offers as its own
    {"asset"},
    {"baked_cache"},
    {"api", "asset_page"},
)
NEIGHBORS = {("caches", "skinning"), ("optimization", "skinning")}
NEIGHBORS |= {
    ("simulation", "skinning"),
    ("simulation", "operations"),
    ("exchange", "caches"),
    ("exchange", "skinning"),
}
LEVEL = {package: level for level, packages in enumerate(LEVELS) for package in packages}

MODULES = sorted(path for path in (ROOT / "anim").rglob("*.py") if path.name != "__main__.py")  # which runs the command
COMMANDS = sorted((ROOT / "cli").rglob("*.py"))
KERNELS = [path for path in MODULES if path.parent.name == "kernels" and path.stem not in ("__init__", "layout")]
TERMINAL = {"typer", "click", "rich", "argparse"}
OPENING = {  # modules of the library that may open a path
    "anim/asset.py",
    "anim/caches/cache_file.py",
    "anim/caches/formats/usd_package.py",  # its library takes names only
    "anim/caches/temporary_files.py",  # for libraries that take names only
    "anim/files/atomic.py",
    "anim/files/folder_lock.py",
    "anim/files/guard.py",
    "anim/files/resolver.py",
    "anim/files/special_files.py",
    "anim/gltf/io/file_references.py",
    "anim/gltf/io/gltf_files.py",
    "anim/gltf/io/images.py",
    "anim/gltf/io/source.py",
    "anim/gltf/io/unused_buffers.py",
    "anim/memory.py",  # /proc/self/status
    "anim/optimization/process_pool.py",
    "anim/skinning/kernels/jit.py",  # where compiled kernels are kept
}
FORBIDDEN_CALLS = {"print", "open", "input", "exit", "sys.exit", "id"}  # id: values are keys themselves
FORBIDDEN_METHODS = {"read_bytes", "write_bytes", "read_text", "write_text"}
FORBIDDEN_ATTRIBUTES = {"sys.stdout", "sys.stderr", "sys.stdin", "sys.argv", "os.environ"}
FORBIDDEN_ATTRIBUTES |= {"time.time", "np.random.seed", "np.fromfile", "np.load", "np.memmap"}
LAZY = {"scipy", "trimesh", "meshopt", "pygltflib", "numba", "llvmlite", "matplotlib", "PIL", "png"}
LAZY |= {"mujoco", "pxr", "alembic3d", "imath", "dask", "distributed", "rapier3d"}
# The modules of sub-packages that other packages may import; all others are internal to theirs.
PUBLIC = {
    "caches.formats": "flipbook_reader gltf mesh_sequence usd_losses usd_face_materials usd_materials usd_stage",
    "caches.source_document": "bake_source lit_meshes shading_normals single_clip_sources still_source",
    "caches.transforms": "resample statistics up_axis vertex_order",
    "caches.vat": "presets",
    "check.rules": "invalid",
    "curves.easing": "function table",
    "curves.fitting": "adaptive_keys easing_fit key_reduction rotation_fit stacked_keys",
    "curves.tangents": "rule table",
    "exchange.euler": (
        "baked_keys convention evaluate from_euler gimbal leading_pose motion rotation_order to_bvh_motion to_euler "
        "unit_guess"
    ),
    "exchange.formats": "bvh_reader registry",
    "exchange.retarget": (
        "apply bind_pose ground_contact joint_matching joint_roles rest_alignment retained_tracks retarget"
    ),
    "exchange.usd_skel": "write",
    "gltf.io": (
        "buffers container file_references gltf_files images json_text lenient source text_form unused_buffers uri"
    ),
    "gltf.meshopt": "codec storage",
    "gltf.reading": "accessors materials meshes node_constraints reader scene_nodes vertex_colors",
    "gltf.validation": "animation_storage buffer_layout channel_targets extensions hierarchy rules schema",
    "gltf.writing": "append byte_ranges draco_decoding new_accessors references reindex removal unknown_extensions "
    "writer",
    "measure.compare": "diff equal_scenes name_matching vertex_distance",
    "measure.continuity": "continuity knots",
    "measure.continuous_bound": "clip_groups largest_error prover sampled_clips",
    "measure.error": (
        "error_curve metric motion_error point_matrix point_rows reduced_skeleton sample_times shell_points statistics "
        "surface whole_scene"
    ),
    "measure.inspect": ("contents frame_rate inspect report root_motion storage_cost stored_bytes track_statistics"),
    "measure.loops": (
        "clip_ends divided_ranges end_frames joint_gaps loop_analysis loop_criteria loop_kind recommendations "
        "skin_motion"
    ),
    "optimization.search": "plan",
    "optimization.tracks": "clip_ends needed_keys",
    "show.filmstrip": "camera clips filmstrip frame_selection image_file",
    "show.page": "bakes comparison notebook page paired_meshes resources sources",
    "show.plots": (
        "collapse_plot easing_plot error_plot figure rate_distortion_plot rotations simulation_plot "
        "stability_plot tangent_plot track_plot track_selection"
    ),
    "show.terminal": "picture",
    "simulation.cloth": "colliders model options selection simulate solver",
    "simulation.particles": "attractors emission forces obstacles options rigid_colliders simulate solver",
    "simulation.rigid_bodies": "description node_globs options simulate",
    "simulation.spring_bones": "chain_globs chains colliders json_reader penetration read reduction report simulate",
    "skinning.analysis": (
        "collapse collapsed_clips inbetween_error method_deviation method_scores recommendations weight_sums"
    ),
    "skinning.kernels": "jit",
    "skinning.methods": "registry",
}


def test_modules_are_found() -> None:
    assert len(MODULES) > 200
    assert len(COMMANDS) > 30


def test_a_module_imports_only_from_below() -> None:
    wrong = []
    for path in MODULES:
        package = _package(path)
        for name in _imported(path):
            parts = name.split(".")
            if parts[0] in {"cli", "fixtures", "tests"}:
                wrong.append((_short(path), name))
            if parts[0] != "anim" or len(parts) == 1 or package is None:
                continue
            other = parts[1]
            assert other in LEVEL, f"{_short(path)} imports {name}, a package without a level"
            if other != package and LEVEL[other] >= LEVEL[package] and (package, other) not in NEIGHBORS:
                wrong.append((_short(path), name))
    assert not wrong, "imports go from later to earlier LEVELS: move the code down, or pass the value as a parameter"


def test_internal_modules_are_imported_by_their_own_package_only() -> None:
    used = _modules_used_outside_their_package()
    public = {f"{package}.{name}" for package, names in PUBLIC.items() for name in names.split()}
    assert not {name: users for name, users in used.items() if name not in public}, (
        "add it to PUBLIC here, or move code"
    )
    assert not public - used.keys(), "remove it from PUBLIC: no other package imports it"


def test_the_library_neither_prints_nor_opens_files() -> None:
    wrong = []
    for path in MODULES:
        found = {name for name in _imported(path) if name.split(".")[0] in TERMINAL}
        if _short(path) not in OPENING:
            found |= _imported(path) & {"pathlib.Path", "pathlib", "mmap"}
        for node in ast.walk(_tree(path)):
            if isinstance(node, ast.Call):
                found |= {ast.unparse(node.func)} & FORBIDDEN_CALLS
            if isinstance(node, ast.Attribute):
                found |= {node.attr} & FORBIDDEN_METHODS
                found |= {ast.unparse(node)} & FORBIDDEN_ATTRIBUTES
        wrong += [(_short(path), name) for name in sorted(found)]
    assert not wrong, "take bytes as a parameter, or add the module to OPENING; `cli` prints and reads options"


def test_no_module_imports_itself_through_others() -> None:
    circles = [_short(path) for path in MODULES if path in _reachable(path)]
    assert not circles, "these import themselves through others: move what both use to a module below"


def test_the_command_line_imports_the_library_only() -> None:
    others = {"fixtures", "tests", "click", "pygltflib", "scipy", "trimesh"}
    wrong = [(_short(p), name) for p in COMMANDS for name in _imported(p) if name.split(".")[0] in others]
    assert not wrong, "call a function of `anim` for it"


def test_heavy_packages_are_imported_late() -> None:
    """Kernels load numba, and are themselves imported late."""
    kernels = tuple(map(_dotted, KERNELS))
    wrong = []
    for path in (*MODULES, *COMMANDS):
        heavy = LAZY - {"numba"} if path in KERNELS else LAZY
        for name in {name for node in _tree(path).body for name in _names(node)}:
            if name.split(".")[0] in heavy or (path not in KERNELS and name.startswith(kernels)):
                wrong.append((_short(path), name))
    assert not wrong, "import it inside of the function that uses it: start-up loads numpy and typer only"


def test_one_module_imports_rapier_and_one_is_its_interface() -> None:
    folder = ROOT / "anim" / "simulation" / "rigid_bodies" / "rapier"
    users = [path for path in MODULES if any(name.partition(".")[0] == "rapier3d" for name in _imported(path))]
    assert users == [folder / "package.py"]
    inside = "anim.simulation.rigid_bodies.rapier."
    interfaces = {
        name.removeprefix(inside).partition(".")[0]
        for path in MODULES
        if path.parent != folder
        for name in _imported(path)
        if name.startswith(inside)
    }
    assert interfaces == {"world"}


def test_the_cache_of_machine_code_knows_all_kernels() -> None:
    """A change of any kernel makes a new cache: numba doesn't check callees."""
    folders = {path.parent.relative_to(ROOT / "anim").as_posix() for path in KERNELS}
    assert folders == set(KERNEL_FOLDERS), "KERNEL_FOLDERS of skinning/kernels/jit.py lists folders of kernels"


def test_importing_the_library_loads_nothing_heavy() -> None:
    names = [_dotted(path) for path in MODULES if path not in KERNELS]
    script = f"import sys, importlib\nfor name in {names!r}: importlib.import_module(name)\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not set(run.stdout.split()) & (LAZY | TERMINAL)


def _modules_used_outside_their_package() -> dict[str, set[str]]:
    """Modules of sub-packages that other packages import, "curves.easing.table", and the files that do."""
    used: dict[str, set[str]] = {}
    for path in (*MODULES, *COMMANDS):
        for file in _modules_of(path, with_types=True):
            parts = file.relative_to(ROOT / "anim").with_suffix("").parts
            if len(parts) == 3 and (path in COMMANDS or _package(path) != parts[0]):
                used.setdefault(".".join(parts), set()).add(_short(path))
    return used


def _reachable(path: Path) -> set[Path]:
    """Modules of the library that a module imports, itself or through others."""
    seen: set[Path] = set()
    waiting = [path]
    while waiting:
        new = _modules_of(waiting.pop()) - seen
        seen |= new
        waiting.extend(new)
    return seen


def _short(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def _package(path: Path) -> str | None:
    """The package of a module below `anim`, None for `anim` itself."""
    parts = path.relative_to(ROOT / "anim").with_suffix("").parts
    return None if parts[0] == "__init__" else parts[0]


def _dotted(path: Path) -> str:
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    return name.removesuffix(".__init__")


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def _imported(path: Path) -> frozenset[str]:
    return frozenset(name for node in ast.walk(_tree(path)) for name in _names(node))


def _names(node: ast.AST) -> list[str]:
    """The names in an import statement: "anim.gltf.reading.reader" for `from anim.gltf.reading import reader`."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        assert node.level == 0, "imports are absolute"
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return []


@cache
def _modules_of(path: Path, with_types: bool = False) -> frozenset[Path]:
    """Modules of the library that one imports, those for type checkers only if asked for; no packages."""
    left_out = set() if with_types else set(_only_for_types(path))
    names = {name for name in _imported(path) - left_out if name.startswith("anim.")}
    both = names | {name.rpartition(".")[0] for name in names}  # `from anim.arrays import Floats` names a module's part
    files = {ROOT / (name.replace(".", "/") + ".py") for name in both}
    return frozenset(file for file in files if file.is_file())


def _only_for_types(path: Path) -> Iterator[str]:
    for node in _tree(path).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            yield from (name for statement in node.body for name in _names(statement))
