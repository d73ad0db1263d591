"""Divergence of a cloth: points beyond all bounds, or edges far longer than the fabric can be."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.errors import UnstableError
from anim.simulation.cloth.model import ClothModel

MAX_SPEED_M_S = 1e4
MAX_LENGTH_PER_REST = 3.0  # of an edge, times the fabric's own elongation
MAX_ELASTIC_ELONGATION = 10.0  # of a fabric that is still one
MAX_EXCESS_PER_DIAGONAL = 0.05  # of an edge's length beyond that, of the cloth's size
MAX_LONG_EDGES_FRACTION = 0.01  # of all edges; a few short ones are too long where points meet a collider or a pin


def check_motion(p: Floats, v: Floats, frame: int) -> None:
    """Raise UnstableError for positions and velocities (P, 3) that aren't finite or too fast."""
    speed = float(np.abs(v).max(initial=0.0))
    if not (np.isfinite(p).all() and speed < MAX_SPEED_M_S):
        raise UnstableError(f"the simulation diverges at frame {frame}")


def longest_per_rest(elongation: float) -> float:
    """Return the length per rest length above which an edge is too long for a fabric of an elongation."""
    return MAX_LENGTH_PER_REST * (1 + min(elongation, MAX_ELASTIC_ELONGATION))


def check_lengths(model: ClothModel, p: Floats, elongation: float, frame: int) -> None:
    """Raise UnstableError if edges of points (P, 3) are over three times as long as at rest.

    elongation: of the fabric itself. A few edges count only if they are too long by 5 % of the cloth's size, since an
    edge of some millimetres is soon three times as long. Edges between pinned points don't count: the animation alone
    stretches them.
    """
    edges = model.topology.edges
    is_free = (model.inverse_masses[edges] > 0).any(axis=1)
    a, b = p[edges[is_free]].transpose(1, 0, 2)
    excess = np.linalg.norm(a - b, axis=1) - longest_per_rest(elongation) * model.edge_lengths[is_free]
    size = float(np.linalg.norm(np.ptp(model.rest, axis=0)))
    many = max(MAX_LONG_EDGES_FRACTION * len(excess), 1)
    if float(excess.max()) > MAX_EXCESS_PER_DIAGONAL * size or np.count_nonzero(excess > 0) > many:
        raise UnstableError(
            f"the simulation diverges at frame {frame}: an edge is over {MAX_LENGTH_PER_REST:.2g} times as long"
        )
