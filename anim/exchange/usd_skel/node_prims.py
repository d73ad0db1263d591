"""Nodes as Xform prims: translate, orient and scale, with time samples where a clip moves them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches.formats.usd_stage import ROOT, define_prims
from anim.errors import UnsupportedError
from anim.exchange.usd_skel.prim_names import PrimNames
from anim.maths import quaternion
from anim.model.skeleton import ancestors
from anim.sampling.pose import PosedSkeleton

MAX_LEVELS = 1000  # of prims: usd-core takes seconds to save them, a minute for 4000 levels, and so on with their cube
IDENTITY = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


class NodePrims:
    """Prims of nodes in a stage, made with those above them when they are needed.

    rest: at one frame, the defaults. posed: at the time codes.
    """

    def __init__(self, stage: Any, rest: PosedSkeleton, posed: PosedSkeleton, codes: Sequence[float]) -> None:
        self._stage, self._rest, self._posed, self._codes = stage, rest, posed, codes
        self._paths: dict[int, str] = {}
        self.names = PrimNames()

    def add(self, nodes: Iterable[int]) -> None:
        """Make the prims of nodes and those above them, siblings in the order of the file.

        Raises UnsupportedError for more than MAX_LEVELS levels.
        """
        skeleton = self._rest.skeleton
        wanted = set[int]()
        for node in nodes:
            for each in (node, *ancestors(skeleton.parents, node)):
                if each < 0 or each in wanted:
                    break
                wanted.add(each)
        wanted -= self._paths.keys()
        levels = [[node for node in level.tolist() if node in wanted] for level in skeleton.levels()]
        if (depth := sum(map(bool, levels))) > MAX_LEVELS:
            raise UnsupportedError(f"meshes hang on {depth} levels of nodes (USD is written with up to {MAX_LEVELS})")
        new = [node for level in levels for node in level]
        for node in new:
            parent = self.path(int(skeleton.parents[node]))
            self._paths[node] = self.names.child(parent, skeleton.names[node] or f"node{node}")
        define_prims(self._stage, [(self._paths[node], "Xform") for node in new])
        for node in new:
            self._set_transform(node)

    def path(self, node: int) -> str:
        """Return the path of a node's prim; of −1 that of the stage's root."""
        return ROOT if node < 0 else self._paths[node]

    def _set_transform(self, node: int) -> None:
        from pxr import Gf, UsdGeom

        skeleton = self._rest.skeleton
        path = self._paths[node]
        prim = UsdGeom.Xform(self._stage.GetPrimAtPath(path))
        if skeleton.names[node] and skeleton.names[node] != path.rsplit("/", 1)[1]:
            prim.GetPrim().SetDisplayName(plain_text(skeleton.names[node]))
        sheared = np.flatnonzero(skeleton.sheared == node)
        if len(sheared):
            whole = np.vstack((skeleton.sheared_local[sheared[0]], (0, 0, 0, 1)))
            prim.AddTransformOp().Set(Gf.Matrix4d(whole.T.tolist()))
            return
        rest, pose = self._rest.pose, self._posed.pose
        rows = {name: (getattr(rest, name)[:, node], getattr(pose, name)[:, node]) for name in IDENTITY}
        self._add_op(prim.AddTranslateOp, Gf.Vec3d, *rows["translation"], IDENTITY["translation"])
        # usd-core takes the angle from w, whose float32 has errors of 1e-4 rad
        double = UsdGeom.XformOp.PrecisionDouble
        self._add_op(lambda: prim.AddOrientOp(double), _quaternion, *rows["rotation"], IDENTITY["rotation"])
        self._add_op(prim.AddScaleOp, Gf.Vec3f, *rows["scale"], IDENTITY["scale"])

    def _add_op(self, make: Any, kind: Any, rest: Floats, rows: Floats, identity: Sequence[float]) -> None:
        """Add an operation with its rest value, and its values (F, C) at the time codes unless they are constant."""
        moves = bool((rows != rest[0]).any())
        if not moves and np.array_equal(rest[0], identity):
            return
        operation = make()
        operation.Set(kind(*rest[0].tolist()))
        if moves:
            values = quaternion.align_signs(rows) if rows.shape[1] == 4 else rows
            set_samples(operation, lambda row: kind(*row.tolist()), self._codes, values)


def set_samples(attribute: Any, make: Callable[[AnyArray], Any], codes: Sequence[float], rows: AnyArray) -> None:
    """Set an attribute at time codes; rows (F, …) that stay the same are one default. make: a row → a value of USD."""
    if (rows == rows[0]).all():
        attribute.Set(make(rows[0]))
        return
    for row, code in zip(rows, codes, strict=True):
        attribute.Set(make(row), code)


def plain_text(name: str) -> str:
    """Return a name without lone surrogates, which USD can't store."""
    return name.encode(errors="replace").decode()


def _quaternion(x: float, y: float, z: float, w: float) -> Any:
    from pxr import Gf

    return Gf.Quatd(w, x, y, z)
