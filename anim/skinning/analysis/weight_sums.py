"""Meshes with skin weights that don't add up to 1 in the file; they are normalized and reported."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from anim.model import Mesh, MeshInstance


@dataclass(frozen=True, slots=True)
class WeightSums:
    """Vertices of one mesh with weights that don't add up to 1 in the file.

    mesh: its name, or its node's index. count: number of such vertices. none: number of them without any weight.
    least, most: the sums farthest below and above 1 among the others.
    """

    mesh: str
    count: int
    none: int
    least: float
    most: float

    def in_words(self) -> Iterator[str]:
        """Yield the deviation and its treatment, a line each."""
        start = f"mesh '{self.mesh}': skin weights of"
        if some := self.count - self.none:
            range_ = f"{self.least:.6g}" if self.least == self.most else f"{self.least:.6g} … {self.most:.6g}"
            words = "don't add up to 1 ({}); they are divided by their sum, as players do"
            yield f"{start} {_vertices(some)} {words.format(range_)}"
        if self.none:
            yield f"{start} {_vertices(self.none)} are all 0; they follow the first joint listed, as in three.js"


def unnormalized_weights(instances: Iterable[MeshInstance]) -> list[WeightSums]:
    """Return the skinned meshes with vertices whose weights don't add up to 1, each mesh once.

    Sums that differ from 1 only by rounding don't count: 8 bits leave up to 4/255 of four weights.
    """
    found: dict[Mesh, WeightSums] = {}
    for instance in instances:
        mesh = instance.mesh
        sums = mesh.weight_sums
        if instance.skin is None or sums is None or mesh in found:
            continue
        some = sums[(sums != 1) & (sums > 0)]
        least, most = (float(some.min()), float(some.max())) if len(some) else (0.0, 0.0)
        name = mesh.name or f"node {instance.node}"
        uses = mesh.count_uses()
        found[mesh] = WeightSums(name, int(uses[sums != 1].sum()), int(uses[sums == 0].sum()), least, most)
    return list(found.values())


def _vertices(count: int) -> str:
    return "1 vertex" if count == 1 else f"{count} vertices"
