"""Random clips of a rig: late starts, few or shared keys, all interpolations, integers, pointers to morph weights."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.fuzz.rigs.glb_builder import GlbBuilder, Json

STARTS_S = (0, 0, 0, 0.3, 7.25, 60)
DURATIONS_S = (0.1, 0.5, 1, 1.3, 2.7)
KINDS = ("LINEAR", "LINEAR", "LINEAR", "STEP", "CUBICSPLINE")
PATHS = ("translation", "rotation", "scale")


def add_clips(file: GlbBuilder, random: np.random.Generator, unit: float, num_targets: Mapping[int, int]) -> bool:
    """Add 1 to 3 clips; return whether they have pointers. num_targets: of nodes with a morphed mesh."""
    names = [None, *map(str, random.choice(["Walk", "Idle", "a/b", "", "clip"], size=4))]
    clips = [_Clip(file, random, unit, num_targets) for _ in range(int(random.integers(1, 4)))]
    for clip in clips:
        name = names[random.integers(len(names))]
        file.add("animations", clip.build() | ({} if name is None else {"name": name}))
    return any(clip.has_pointers for clip in clips)


class _Clip:
    """Clip in the making. shared: key times that several of its tracks have."""

    def __init__(
        self, file: GlbBuilder, random: np.random.Generator, unit: float, num_targets: Mapping[int, int]
    ) -> None:
        self._file, self._random, self._unit, self._num_targets = file, random, unit, num_targets
        self._start, self._duration = float(random.choice(STARTS_S)), float(random.choice(DURATIONS_S))
        self._shared = np.linspace(0, self._duration, int(random.integers(2, 40)))
        self._pointed: set[int] = set()
        self.has_pointers = False

    def build(self) -> Json:
        """Return the animation."""
        random = self._random
        nodes = self._file.lists["nodes"]
        rigid = [(i, path) for i, node in enumerate(nodes) if "matrix" not in node for path in PATHS]
        chosen = [rigid[k] for k in random.permutation(len(rigid))[: random.integers(1, 9)]]
        chosen += [(i, "weights") for i in self._num_targets if random.random() < 0.6]
        targets = [self._target(*each) for each in chosen]
        samplers = [
            self._sampler(node, path, single=_is_single(target))
            for (node, path), target in zip(chosen, targets, strict=True)
        ]
        channels = [{"sampler": k, "target": target} for k, target in enumerate(targets)]
        return {"channels": channels, "samplers": samplers}

    def _target(self, node: int, path: str) -> Json:
        """Target of a channel; of weights sometimes a pointer to those of the node or of its mesh."""
        mesh = self._file.lists["nodes"][node].get("mesh", -1)
        if path != "weights" or mesh in self._pointed or self._random.random() < 0.3:
            return {"node": node, "path": path}
        self._pointed.add(mesh)  # one pointer for each mesh
        self.has_pointers = True
        owner = f"/nodes/{node}" if self._random.random() < 0.5 else f"/meshes/{mesh}"
        one = f"/{self._random.integers(self._num_targets[node])}" if self._random.random() < 0.5 else ""
        return {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": f"{owner}/weights{one}"}}}

    def _sampler(self, node: int, path: str, *, single: bool) -> Json:
        times = self._times()
        kind = str(self._random.choice(KINDS)) if len(times) > 1 else "LINEAR"
        values = self._values(node, path, times, kind)
        values = values[:, :1] if single else values
        stored = "f4"
        if kind == "CUBICSPLINE":
            size = self._random.choice([0.0, 0.3]) * (self._unit if path == "translation" else 0.5)
            arriving, leaving = self._random.normal(size=(2, *values.shape)) * size
            values = np.stack([arriving, values, leaving], axis=1).reshape(-1, values.shape[1])
        elif path == "rotation" and self._random.random() < 0.3:
            stored = str(self._random.choice(["i1", "i2"]))
        elif path == "weights" and values.min() >= 0 and values.max() <= 1 and self._random.random() < 0.3:
            stored = str(self._random.choice(["u1", "u2"]))
        if path == "weights":
            values = values.reshape(-1, 1)
        output = self._file.add_accessor(values, stored, normalized=stored != "f4")
        return {"input": self._file.add_accessor(times, bounds=True), "output": output, "interpolation": kind}

    def _times(self) -> Any:
        """Key times, s, from the clip's start: shared ones, one key, or some of a grid."""
        x = self._random.random()
        times = self._shared
        if x < 0.1:
            times = np.array([self._random.choice([0.0, self._duration])])
        elif x < 0.55:
            times = np.round(self._random.random(int(self._random.integers(2, 25))) * 50) * self._duration / 50
        return np.unique((times + self._start).astype(np.float32))

    def _values(self, node: int, path: str, times: Any, kind: str) -> Any:
        """Values (K, C) around those at rest: a wave, or noise."""
        random, count = self._random, len(times)
        rest = self._file.lists["nodes"][node]
        phase = (times.astype(np.float64) - self._start) / self._duration * 2 * np.pi
        width = self._num_targets[node] if path == "weights" else 3
        is_wave = random.random() < 0.6
        motion = np.outer(np.sin(phase), random.normal(size=width)) if is_wave else random.normal(size=(count, width))
        if path == "translation":
            return np.array(rest.get("translation", (0.0, 0.0, 0.0))) + 0.3 * self._unit * motion
        if path == "scale":
            return np.array(rest.get("scale", (1.0, 1.0, 1.0))) * (1 + 0.4 * np.clip(motion, -2, 2))
        if path == "weights":
            return 0.5 + 0.5 * np.sin(motion)
        if kind == "CUBICSPLINE":  # not through zero between two keys
            return Rotation.from_rotvec(0.3 * np.clip(motion, -2, 2)).as_quat()
        signs = random.choice([-1, 1], size=(count, 1)) if random.random() < 0.3 else 1
        return Rotation.from_rotvec(motion).as_quat() * signs


def _is_single(target: Json) -> bool:
    """True for a pointer to one of the weights."""
    pointer: str = target.get("extensions", {}).get("KHR_animation_pointer", {}).get("pointer", "")
    return pointer[-1:].isdigit()
