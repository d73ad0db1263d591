"""`gltf-anim simulate KIND`: a command for each row of SIMULATIONS; each is a module here with a `command`."""

from __future__ import annotations

from anim.simulation.registry import SIMULATIONS
from cli.command_table import CommandInfo
from cli.main import LazyGroup

EXAMPLES = {
    "springs": (
        "gltf-anim simulate springs ponytail.glb swinging.glb --clip walk --loop",
        "gltf-anim simulate springs ponytail.glb soft.glb --chain hair1 --frequency 2.5 --gravity 6",
        "gltf-anim simulate springs ponytail.glb small.glb --stiffness 1 --max-error 0.5mm --report springs.json",
    ),
    "particles": (
        "gltf-anim simulate particles walk.glb sparks.glb --node head --floor 0 --rate 100",
        "gltf-anim simulate particles walk.glb dust.glb --node '*_Foot' --drag 3 --turbulence 0.4 --loop",
        "gltf-anim simulate particles walk.glb rain.glb --node head --drag 2 --integrator rk4 --report rain.json",
    ),
    "cloth": (
        "gltf-anim simulate cloth flag.glb waving.glb --mesh flag --pin x-min --wind 5,0,2",
        "gltf-anim simulate cloth flag.glb flag.npz --mesh flag --pin x-min --max-stretch 5% --report flag.json",
        "gltf-anim simulate cloth flag.glb net.npz --mesh flag --pin x-min --solver mass-spring --stiffness 20",
    ),
    "rigid": (
        "gltf-anim simulate rigid wall.glb fall.glb --body 'brick*' --body ball --velocity ball=0,0,-9 --floor 0",
        "gltf-anim simulate rigid wall.glb box.glb --body 'brick*' --shape box --floor 0 --max-error 1mm",
    ),
}
KINDS = {name: CommandInfo(kind.about, EXAMPLES[name]) for name, kind in SIMULATIONS.items()}


class Group(LazyGroup):
    """Simulate motion from forces, and bake it to keys.

    Two rates: --step is the fixed time step of the simulation, --fps the rate of the frames that are written.
    """

    table = KINDS
    package = __name__
    noun = "kind"
