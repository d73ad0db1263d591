"""Materials of a mesh for drawing: base color textures, vertex colors, alpha at samples of a picture."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from anim.arrays import AnyArray, Bools, Floats, Ints
from anim.show.filmstrip.rasterizer import AlphaTest
from anim.show.filmstrip.surface_pattern import barycentric
from anim.show.filmstrip.texture import TextureSampler

MAX_BATCH_SAMPLES = 1 << 16  # samples colored at a time, 350 bytes each: they fit into the processor's cache
COVERAGE = (np.array([[0, 7, 3], [6, 5, 2], [4, 1, 8]]) + 0.5) / 9  # least alpha of each of 3 × 3 samples
OPAQUE = -1.0  # cutoff below every alpha


@dataclass(frozen=True, slots=True)
class Coating:
    """Material of a primitive. texture: None for none. alpha: of the base color factor.

    cutoff: alpha below which nothing is drawn; OPAQUE for no test; None for blending by the number of drawn samples per
    pixel (alpha to coverage), which needs no order of faces.
    """

    texture: TextureSampler | None = None
    alpha: float = 1.0
    cutoff: float | None = OPAQUE


@dataclass(frozen=True, slots=True)
class Surface:
    """Materials on the faces (T, 3) of a mesh. coating: (T,) index of each face's among `coatings`.

    texcoords: (V, 2). colors: (V, 4) linear RGBA of vertices, or None if all are white.
    """

    faces: Ints
    coating: Ints
    coatings: tuple[Coating, ...]
    texcoords: AnyArray
    colors: AnyArray | None

    def tint(self, corners: Floats, samples: Floats, faces: Ints) -> Floats:
        """Return the linear RGB factor (S, 3) of the base color at samples (S, 2) in pixels of faces (S,).

        corners: (T, 3, 3) of all faces on the screen: x, y and nearness.
        """
        return self._rgba(corners, samples, faces)[:, :3]

    def alpha_test(self, corners: Floats) -> AlphaTest | None:
        """Return the alpha test of faces, None if all are opaque. corners: (T, 3, 3) on the screen."""
        is_opaque = all(each.cutoff == OPAQUE for each in self.coatings)
        return None if is_opaque else partial(self._is_drawn, corners)

    def _is_drawn(self, corners: Floats, faces: Ints, x: Ints, y: Ints) -> Bools:
        """Return a mask (S,) of the faces (S,) drawn at the samples in columns x and rows y, by their alpha.

        corners: (T, 3, 3) of all faces on the screen, in the same unit as x and y.
        """
        result = np.ones(len(faces), bool)
        cutoffs = np.array([np.nan if each.cutoff is None else each.cutoff for each in self.coatings])[self.coating]
        tested = np.flatnonzero(cutoffs[faces] != OPAQUE)
        if len(tested):
            faces, x, y = faces[tested], x[tested], y[tested]
            alpha = self._rgba(corners, np.stack((x + 0.5, y + 0.5), axis=1), faces)[:, 3]
            limit = np.where(np.isnan(cutoffs[faces]), COVERAGE[y % 3, x % 3], cutoffs[faces])
            result[tested] = alpha >= limit
        return result

    def _rgba(self, corners: Floats, samples: Floats, faces: Ints) -> Floats:
        """Product of texture and vertex colors, with the full alpha."""
        result = np.empty((len(faces), 4))
        for start in range(0, len(faces), MAX_BATCH_SAMPLES):
            some = slice(start, start + MAX_BATCH_SAMPLES)
            result[some] = self._of_some(corners[faces[some]], samples[some], faces[some])
        return result

    def _of_some(self, corners: Floats, samples: Floats, faces: Ints) -> Floats:
        shares = barycentric(corners, samples) * corners[:, :, 2]  # on the screen → in space
        shares /= shares.sum(axis=1, keepdims=True)
        vertices, coating = self.faces[faces], self.coating[faces]
        result = np.ones((len(faces), 4))
        if self.colors is not None:
            result[:] = np.einsum("sc,sci->si", shares, self.colors[vertices])
        for i, chosen in _groups(coating):
            texture = self.coatings[i].texture
            if texture is not None:
                places = np.einsum("sc,sci->si", shares[chosen], self.texcoords[vertices[chosen]].astype(np.float64))
                result[chosen] *= texture.sample(places)
        result[:, 3] *= np.array([each.alpha for each in self.coatings])[coating]
        return result


def _groups(indices: Ints) -> Iterator[tuple[int, Ints]]:
    """Yield each distinct index with its positions."""
    order = np.argsort(indices, kind="stable")
    starts = np.flatnonzero(np.diff(indices[order], prepend=-1))
    for places in np.split(order, starts[1:]) if len(order) else ():
        yield int(indices[places[0]]), places
