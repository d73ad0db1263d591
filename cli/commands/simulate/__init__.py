"""`gltf-anim simulate KIND`: the table of kinds; each is a module here with a `command`."""

from __future__ import annotations

from cli.main import CommandInfo, LazyGroup

KINDS: dict[str, CommandInfo] = {}


class Group(LazyGroup):
    """Simulate motion from forces, and write it as keys.

    Time is two things here: --step is the fixed step of the simulation, --fps the rate of the frames that are written.
    """

    table = KINDS
    package = __name__
    noun = "kind"
