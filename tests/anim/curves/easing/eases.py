"""Names of eases, with arguments too, that tests go through."""

from __future__ import annotations

import numpy as np

from anim.curves.easing.table import EASING_FACTORIES, EASINGS

SMOOTH = [*EASINGS, *(text for name, each in EASING_FACTORIES.items() if name != "steps" for text in each.examples)]
STEPS = list(EASING_FACTORIES["steps"].examples)
U = np.linspace(0, 1, 1001)
FAMILIES = ["quad", "cubic", "quart", "quint", "sine", "expo", "circ", "back", "elastic", "bounce"]
