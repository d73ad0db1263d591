"""Search for a skeleton whose bind pose a skin shares."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from anim.arrays import Floats
from anim.model import Skin

BIND_TOLERANCE_PER_DIAGONAL = 1e-6  # of the mesh, to its corners: rounding of float32 matrices
IDENTITY, IDENTITY_TOLERANCE = np.eye(4), 1e-6
MAX_POSES_PER_JOINT = 8  # compared with a skin; a character has a few, and each skin with all would be quadratic


class BindPoses:
    """Skeletons by their joints, and by the skins that they have."""

    def __init__(self) -> None:
        self._of_joint: dict[int, list[int]] = {}
        self._of_skin: dict[tuple[bytes, bytes], int] = {}

    def candidates(self, skin: Skin) -> list[int]:
        """Return the numbers of skeletons to compare: the first ones with a common joint, then one with an equal skin.

        Of no joint are more than MAX_POSES_PER_JOINT, and of all together no more than that.
        """
        common = {number for node in skin.joints.tolist() for number in self._of_joint.get(node, ())}
        first = sorted(common)[:MAX_POSES_PER_JOINT]
        equal = self._of_skin.get(_key(skin))
        return first if equal is None or equal in first else [*first, equal]

    def add(self, skin: Skin, number: int) -> None:
        """Add a skin of a skeleton, by its number."""
        self._of_skin.setdefault(_key(skin), number)
        for node in skin.joints.tolist():
            known = self._of_joint.setdefault(node, [])
            if len(known) < MAX_POSES_PER_JOINT and number not in known:
                known.append(number)


def _key(skin: Skin) -> tuple[bytes, bytes]:
    return skin.joints.tobytes(), skin.inverse_bind.tobytes()


class BindPose:
    """Bind pose of a mesh.

    binds: joint_from_mesh (4, 4) by node. positions: (V, 3) of the mesh.
    """

    def __init__(self, binds: Mapping[int, Floats], positions: Floats) -> None:
        self._binds, self._number = binds, {node: i for i, node in enumerate(binds)}
        self._inverse = np.linalg.inv(np.array([*binds.values()]))
        low, high = positions.min(axis=0), positions.max(axis=0)
        box = [(x, y, z, 1) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        self._corners = np.array(box)
        self._limit = BIND_TOLERANCE_PER_DIAGONAL * float(np.linalg.norm(high - low))

    def matrix_into(self, group: Mapping[int, Floats]) -> Floats | None:
        """Return the matrix (4, 4) from the mesh to the bind pose of a skeleton; None for none, or no common joint.

        group: joint_from_skeleton (4, 4) by node.
        """
        common = [node for node in self._binds if node in group]
        if not common:
            return None
        matrix = np.linalg.inv(group[common[0]]) @ self._binds[common[0]]
        if np.abs(matrix - IDENTITY).max() < IDENTITY_TOLERANCE:
            matrix = np.eye(4)
        inverse = self._inverse[[self._number[node] for node in common]]
        difference = inverse @ (np.array([group[node] for node in common]) @ matrix) - IDENTITY
        moved = (self._corners @ difference.swapaxes(-1, -2))[..., :3]
        return matrix if np.sqrt((moved * moved).sum(axis=-1).max()) <= self._limit else None
