"""Boxes and attractors of particles by options, at positions or on nodes."""

from __future__ import annotations

import math

from anim.measure.error.surface import diagonal
from anim.model import Scene
from anim.operations.selection import Selection
from anim.simulation.particles.attractors import Attractor
from anim.simulation.particles.obstacles import Box
from cli import units
from cli.errors import UsageError
from cli.options.simulation import name_option

ATTRACTOR_RADIUS = "10%"


def parse_box(given: str, scene: Scene) -> Box:
    """Return the box of "NODE,SX,SY,SZ" or "X,Y,Z,SX,SY,SZ"."""
    with name_option("--box", given):
        return _box(given, scene)


def _box(given: str, scene: Scene) -> Box:
    parts = given.split(",")
    numbers = [_as_number(each) for each in parts]
    if len(parts) == 6 and None not in numbers:
        x, y, z, *sizes = (value or 0.0 for value in numbers)
        return Box((x, y, z), (sizes[0], sizes[1], sizes[2]))
    if len(parts) < 4 or None in numbers[-3:]:
        raise UsageError(f"--box is '{given}' (expected NODE,SX,SY,SZ or X,Y,Z,SX,SY,SZ)")
    sizes = [value or 0.0 for value in numbers[-3:]]
    return Box((0.0, 0.0, 0.0), (sizes[0], sizes[1], sizes[2]), _node(",".join(parts[:-3]), "--box", scene))


def parse_attractor(given: str, scene: Scene) -> Attractor:
    """Return the attractor of "NODE:STRENGTH" or "NODE:STRENGTH:RADIUS"."""
    parts = given.split(":")
    has_radius = len(parts) > 2 and _as_number(parts[-2]) is not None
    strength = _as_number(parts[-2 if has_radius else -1])
    name = ":".join(parts[: -2 if has_radius else -1])
    if strength is None or not name:
        raise UsageError(f"--attractor is '{given}' (expected NODE:STRENGTH or NODE:STRENGTH:RADIUS)")
    radius = units.parse_length(parts[-1] if has_radius else ATTRACTOR_RADIUS, "--attractor", lambda: diagonal(scene))
    node = _node(name, "--attractor", scene)
    with name_option("--attractor", given):
        return Attractor(strength, radius, node)


def _as_number(given: str) -> float | None:
    """A finite number, or None."""
    try:
        value = float(given)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _node(glob: str, option: str, scene: Scene) -> int:
    found = sorted(Selection((), (glob,)).chosen_nodes(scene.skeleton))
    if len(found) > 1:
        raise UsageError(f"{option} '{glob}' names {len(found)} nodes (expected one)")
    return found[0]
