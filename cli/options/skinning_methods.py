"""The skinning methods as choices of an option."""

from __future__ import annotations

from enum import StrEnum

from anim.skinning.methods.registry import SKINNING_METHODS

Method = StrEnum("Method", [(name, name) for name in SKINNING_METHODS])  # type: ignore[misc]
ABOUT = "; ".join(f"{name}: {method.about}" for name, method in SKINNING_METHODS.items()) + "."
