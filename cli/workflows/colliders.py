"""Colliders of cloth and particles by options: on nodes, at positions, of spring bones, or of a JSON file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from anim.files import resolver
from anim.gltf.document import Document
from anim.model import Scene
from anim.operations.selection import Selection
from anim.simulation.cloth.colliders import Capsule, Obstacle, Plane, from_spring_colliders
from anim.simulation.spring_bones.json_reader import read_spring_file
from anim.simulation.spring_bones.read import read_colliders
from cli.errors import UsageError
from cli.io import documents
from cli.options.simulation import name_option, parse_numbers, parse_vector

VRM = "vrm"
ORIGIN = (0.0, 0.0, 0.0)
UP = (0.0, 1.0, 0.0)


def parse_colliders(
    document: Document,
    scene: Scene,
    *,
    spheres: Iterable[str],
    capsules: Iterable[str],
    planes: Iterable[str],
    files: Sequence[str],
) -> tuple[Obstacle, ...]:
    """Return all colliders that the options name. files: "vrm" or names of JSON files."""
    found: list[Obstacle] = []
    for option, parse, texts in (
        ("--sphere", _sphere, spheres),
        ("--capsule", _capsule, capsules),
        ("--plane", _plane, planes),
    ):
        for each in texts:
            with name_option(option, each):
                found.append(parse(each, scene))
    for each in files:
        found += _of_file(each, document, scene)
    return tuple(found)


def _of_file(name: str, document: Document, scene: Scene) -> tuple[Obstacle, ...]:
    if name == VRM:
        return from_spring_colliders(read_colliders(document))
    with documents.content(name, ending=".json", read=resolver.read_options) as (data, _):
        bones = read_spring_file(data.tobytes(), scene.skeleton, has_chains=False)
    return from_spring_colliders(bones.colliders)


def _sphere(given: str, scene: Scene) -> Obstacle:
    parts = given.split(",")
    if len(parts) == 2:
        node, radius = _node(parts[0], scene), _radius(parts[1], "--sphere", given)
        return Capsule(ORIGIN, ORIGIN, radius, node, node)
    if len(parts) != 4:
        raise UsageError(f"--sphere is '{given}' (expected NODE,R or X,Y,Z,R)")
    at = parse_vector(",".join(parts[:3]), "--sphere")
    return Capsule(at, at, _radius(parts[3], "--sphere", given))


def _capsule(given: str, scene: Scene) -> Obstacle:
    parts = given.split(",")
    if len(parts) != 3:
        raise UsageError(f"--capsule is '{given}' (expected NODE,NODE,R)")
    radius = _radius(parts[2], "--capsule", given)
    return Capsule(ORIGIN, ORIGIN, radius, _node(parts[0], scene), _node(parts[1], scene))


def _plane(given: str, scene: Scene) -> Obstacle:
    parts = given.split(",")
    if len(parts) == 6:
        values = parse_numbers(given, 6, "--plane")
        return Plane((values[0], values[1], values[2]), (values[3], values[4], values[5]))
    if len(parts) not in (1, 4):
        raise UsageError(f"--plane is '{given}' (expected NODE, NODE,NX,NY,NZ or X,Y,Z,NX,NY,NZ)")
    normal = parse_vector(",".join(parts[1:]), "--plane") if len(parts) == 4 else UP
    return Plane(ORIGIN, normal, _node(parts[0], scene))


def _node(glob: str, scene: Scene) -> int:
    found = sorted(Selection((), (glob,)).chosen_nodes(scene.skeleton))
    if len(found) > 1:
        raise UsageError(f"'{glob}' names {len(found)} nodes (expected one)")
    return found[0]


def _radius(given: str, option: str, whole: str) -> float:
    try:
        return float(given)
    except ValueError:
        raise UsageError(f"{option} is '{whole}': '{given}' is no radius in metres") from None
