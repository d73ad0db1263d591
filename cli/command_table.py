"""Table of commands."""

from __future__ import annotations

from typing import NamedTuple


class CommandInfo(NamedTuple):
    """One command: its line in `--help`, and the examples at the end of its own help."""

    about: str
    examples: tuple[str, ...]


COMMANDS = {
    "inspect": CommandInfo(
        "Show the contents of files, with findings and advice.",
        (
            "gltf-anim inspect walk.glb",
            "gltf-anim inspect *.glb --format json > report.json",
            "gltf-anim inspect hero.glb --clip 'Run*' --tracks",
            "gltf-anim inspect *.glb --fail-on error > health.txt",
        ),
    ),
    "check": CommandInfo(
        "Check files by rules, and fail on errors.",
        (
            "gltf-anim check walk.glb hero.glb",
            "gltf-anim check . --fail-on warning --ignore GA113",
            "gltf-anim check --explain GA101",
            "gltf-anim check '**/*.glb' --format sarif > findings.sarif",
        ),
    ),
    "run": CommandInfo(
        "Run recipes over many files: cached, on all cores.",
        (
            "gltf-anim run",
            "gltf-anim run crowd --recipe small --jobs 4",
            "gltf-anim run --resume --no-cache",
        ),
    ),
    "sample": CommandInfo(
        "Sample the pose of every node at chosen times.",
        (
            "gltf-anim sample walk.glb --at 0.5",
            "gltf-anim sample walk.glb poses.npz --fps 60 --space world",
            "gltf-anim sample walk.glb --fps 30 --node '*Foot*' --format csv",
        ),
    ),
    "resample": CommandInfo(
        "Resample clips to a regular grid of frames.",
        (
            "gltf-anim resample walk.glb walk30.glb --fps 30",
            "gltf-anim resample hero.glb hero.glb --fps 24 --clip 'Run*' --dry-run",
            "cat walk.glb | gltf-anim resample --fps 30 | gltf-anim inspect",
            "gltf-anim resample . -o 'out/{path}' --fps 30",
        ),
    ),
    "from-euler": CommandInfo(
        "Convert Euler tracks (BVH, CSV, JSON) to glTF.",
        (
            "gltf-anim from-euler walk.bvh walk.glb --skeleton-mesh sticks",
            "gltf-anim from-euler walk.bvh hero-walk.glb --onto hero.glb --fail-unmatched 12",
            "gltf-anim from-euler curves.csv door.glb --order XYZ --axes extrinsic --unit deg",
        ),
    ),
    "to-euler": CommandInfo(
        "Write a clip as continuous Euler curves: BVH, CSV or JSON.",
        (
            "gltf-anim to-euler hero.glb walk.bvh --clip walk --fps 30",
            "gltf-anim to-euler door.glb door.csv --order XYZ --axes extrinsic",
            "gltf-anim to-euler door.glb door.json --angle-tolerance 0.1deg",
        ),
    ),
    "ease": CommandInfo(
        "Change the speed of motion between keys by an easing.",
        (
            "gltf-anim ease --list",
            "gltf-anim ease poses.glb eased.glb --ease smoothstep",
            "gltf-anim ease walk.glb slow-in.glb --per range --ease 'cubic-bezier(.2, 0, 0, 1)' --clip walk",
        ),
    ),
    "spline": CommandInfo(
        "Put smooth curves through keys, by a tangent rule.",
        (
            "gltf-anim spline poses.glb smooth.glb",
            "gltf-anim spline walk.glb loop.glb --tangents natural --cyclic",
            "gltf-anim spline face.glb face2.glb --tangents monotone --path weights",
        ),
    ),
    "retime": CommandInfo(
        "Change the timing of clips: speed, duration, direction, delay.",
        (
            "gltf-anim retime walk.glb slow.glb --speed 0.25",
            "gltf-anim retime walk.glb back.glb --reverse --clip walk",
            "gltf-anim retime walk.glb pendulum.glb --warp sine-in-out --ping-pong",
        ),
    ),
    "trim": CommandInfo(
        "Keep one time range of clips.",
        (
            "gltf-anim trim walk.glb step.glb --from 0.25 --to 0.75 --rebase",
            "gltf-anim trim . -o 'out/{path}' --rebase",
        ),
    ),
    "loop": CommandInfo(
        "Report whether clips loop, and close them.",
        (
            "gltf-anim loop walk.glb",
            "gltf-anim loop walk.glb --find --format json",
            "gltf-anim loop walk.glb closed.glb --blend 0.2",
        ),
    ),
    "bake": CommandInfo(
        "Bake skinning and morph targets to vertex caches.",
        (
            "gltf-anim bake walk.glb walk.npz --method dqs --fps 30",
            "gltf-anim bake hero.glb '{clip}.usdc' --fps 24 --normals",
            "gltf-anim bake face.glb face.npz --clip talk --mesh Head --space mesh",
        ),
    ),
    "plot": CommandInfo(
        "Plot the curves of tracks, of easings, or of tangent rules.",
        (
            "gltf-anim plot walk.glb walk.png --clip walk --node 'Hip*'",
            "gltf-anim plot walk.glb walk.svg --compare walk30.glb --path rotation",
            "gltf-anim plot --ease smoothstep --ease 'cubic-bezier(.2,0,0,1)' eases.svg",
            "gltf-anim plot --through 0,0.9,0.2,1 --tangents catmull-rom --tangents natural curve.svg",
            "gltf-anim plot --integrators --omega 20 --step 1/60 stability.png",
            "gltf-anim plot walk.glb --terminal --limit 2",
        ),
    ),
    "view": CommandInfo(
        "Show files as a page that plays them, or compares two.",
        (
            "gltf-anim view walk.glb -o walk.html",
            "gltf-anim view walk.glb walk30.glb -o compared.html --show heat,bones",
            "gltf-anim view hero.glb -o hip.html --clip 'Run*' --node Hips --at 0.25 --show curves",
            "gltf-anim view walk.bvh -o motion.html",
        ),
    ),
    "collapse": CommandInfo(
        "Find where skin collapses, and compare skinning methods.",
        (
            "gltf-anim collapse hero.glb",
            "gltf-anim collapse hero.glb --clip 'Attack*' --method lbs --method cor --format json",
            "gltf-anim collapse arm.glb --plot arm.png",
        ),
    ),
    "convert-cache": CommandInfo(
        "Convert a vertex cache to another format.",
        (
            "gltf-anim convert-cache walk.npz walk.pc2 --up z --vertex-order blender",
            "gltf-anim convert-cache walk.npz walk.glb --max-error 0.5mm --quantize",
            "gltf-anim convert-cache walk.mdd walk.exr --preset godot --depth half",
        ),
    ),
    "render": CommandInfo(
        "Draw clips as a filmstrip or as an animated image.",
        (
            "gltf-anim render walk.glb walk.png",
            "gltf-anim render arm.glb twist.png --method lbs --method dqs --heat --clip twist",
            "gltf-anim render walk.npz walk.webp --frames 24",
            "gltf-anim render walk.glb --terminal --at 0.2 --at 0.4",
        ),
    ),
    "simulate": CommandInfo(
        "Simulate motion from forces, and bake it to keys.",
        ("gltf-anim simulate particles walk.glb sparks.glb --node head --floor 0",),
    ),
    "optimize": CommandInfo(
        "Make animations smaller, within an error that no vertex exceeds.",
        (
            "gltf-anim optimize hero.glb small.glb --max-error 0.1%",
            "gltf-anim optimize hero.glb small.glb --max-error 0.5mm --meshopt ext --drop rest --report small.json",
            "gltf-anim optimize hero.glb small.glb --max-bytes 260kB --effort fast",
            "gltf-anim optimize hero.glb --curve size-against-error.csv --effort fast",
        ),
    ),
    "diff": CommandInfo(
        "Measure the difference between the motion of two files.",
        (
            "gltf-anim diff walk.glb walk30.glb",
            "gltf-anim diff walk.glb walk30.glb --plot error.png --player three",
            "gltf-anim diff walk.glb walk30.glb --fail-above 20% --format json > diff.json",
        ),
    ),
    "convert": CommandInfo(
        "Convert between .glb and .gltf, or to skinned USD.",
        (
            "gltf-anim convert walk.glb walk.gltf",
            "gltf-anim convert scene/walk.gltf - | gltf-anim inspect",
            "gltf-anim convert walk.glb walk.usdz --fps 30",
        ),
    ),
}
