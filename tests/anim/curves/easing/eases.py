"""Names of eases, with arguments too, that tests go through."""

from __future__ import annotations

import numpy as np

from anim.curves.easing.table import EASINGS

WITH_ARGUMENTS = [
    "cubic-bezier(0.2, 0, 0, 1)",
    "cubic-bezier(1/3, -0.4, 2/3, 1.7)",
    "cubic-bezier(0, 1.5, 1, -0.5)",
    "cubic-bezier(0.5, 0.5, 0.5, 0.5)",
    "cubic-bezier(1, 0, 0, 1)",
    "spring(100, 10)",
    "spring(100, 2)",
    "spring(100, 20)",
    "spring(100, 300)",
    "hermite(-1, 4)",
    "back(3)",
    "back-in(0.5)",
    "back-in-out(2)",
]
SMOOTH = [*EASINGS, *WITH_ARGUMENTS]
STEPS = ["steps(1)", "steps(5)", "steps(4, jump-start)", "steps(3, both)", "steps(3, none)"]
U = np.linspace(0, 1, 1001)
FAMILIES = ["quad", "cubic", "quart", "quint", "sine", "expo", "circ", "back", "elastic", "bounce"]
