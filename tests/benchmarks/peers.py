"""The cheapest animation that other tools reach within a bound, over all their settings that could matter.

glTF-Transform is `gltf-transform` (npm @gltf-transform/cli), gltfpack is `gltfpack` (npm gltfpack), each looked for in
the folder $GLTF_PEERS_DIR, in node_modules/.bin beside pyproject.toml and on the PATH. They are tried alone and one
after the other. gltfpack keeps nodes by name (-kn), so that its motion can be compared, and is run with native key
times (-af 0) besides its own 30 Hz: without that, and with its default 12 bits, it is a far weaker peer.

Outputs and verdicts are kept in $GLTF_BENCH_CACHE, or in a folder of the system's temporary one, by what they depend
on.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from tests.benchmarks.animation_cost import Cost, animation_cost
from tests.judge import SCRIPTS, judge

ROOT = Path(__file__).resolve().parents[2]
TRANSFORM, PACK = "gltf-transform", "gltfpack"
MODES = ("core", "ext", "khr")  # each may use what the ones before it may
BITS = (11, 12, 13, 14, 15, 16)  # of rotations, gltfpack's -ar; its default is 12
RATES = (0, 24, 30, 60)  # Hz, gltfpack's -af; 0 keeps key times
TOLERANCES = ("1e-3", "1e-4", "1e-5")  # of gltf-transform resample; its default is 1e-4


@dataclass(frozen=True, slots=True)
class Setting:
    """Command lines to be run one after the other, without the names of files. mode: the least that players need."""

    mode: str
    commands: tuple[tuple[str, ...], ...]

    @property
    def name(self) -> str:
        """As in tables: "GT 1e-4 + pack -kn -af 0"."""
        return " + ".join(" ".join(one).replace(TRANSFORM, "GT").replace(PACK, "pack") for one in self.commands)


@dataclass(frozen=True, slots=True)
class Result:
    """What a setting made of a file. error: largest displacement as a share of the diagonal, None if not judged yet."""

    setting: str
    mode: str
    cost: Cost
    output: Path
    error: float | None = None


def settings() -> Iterator[Setting]:
    """Return every setting that is tried."""
    sources: list[tuple[tuple[str, ...], ...]] = [()]
    for tolerance in TOLERANCES:
        resampled = ((TRANSFORM, "resample", "--tolerance", tolerance),)
        yield Setting("core", resampled)
        yield Setting("core", (*resampled, (TRANSFORM, "dedup")))
        sources.append(resampled)
    yield Setting("ext", (sources[2][0], (TRANSFORM, "meshopt", "--level", "high")))
    for source in sources:
        for rate in RATES:
            pack = (PACK, "-kn", "-af", str(rate))
            yield Setting("core", (*source, pack))
            yield Setting("ext", (*source, (*pack, "-c")))  # the codec without filters: all 16 bits of rotations
            yield Setting("khr", (*source, (*pack, "-c", "-ce", "khr")))
            for mode, flag in (("ext", "-cc"), ("khr", "-cz")):
                yield Setting(mode, (*source, (*pack, flag)))
                if rate in (0, 30) and source in sources[:3:2]:
                    for bits in BITS:
                        yield Setting(mode, (*source, (*pack, flag, "-ar", str(bits), "-at", "20")))


def cheapest(source: Path, mode: str, bound: float) -> Result | None:
    """Return the cheapest result within a bound (share of the diagonal) that players of this mode can play, or None."""
    allowed = MODES[: MODES.index(mode) + 1]
    results = [made(source, each) for each in settings() if each.mode in allowed]
    for result in sorted(results, key=lambda each: each.cost.total):  # so that few are judged
        judged = with_error(source, result)
        if judged.error is not None and judged.error <= bound:
            return judged
    return None


def made(source: Path, setting: Setting) -> Result:
    """Return what the setting makes of the file, not judged."""
    folder = _folder(source, setting)
    output, about = folder / "out.glb", folder / "cost.json"
    if not about.exists():
        _run(source, setting, output)
        about.write_text(json.dumps(asdict(animation_cost(output))))
    return Result(setting.name, setting.mode, Cost(**json.loads(about.read_text())), output)


def with_error(source: Path, result: Result) -> Result:
    """Return the result with its error by the independent judge; clips that are missing count as at rest."""
    verdict = result.output.parent / f"error-{_judge_version()}.json"
    if not verdict.exists():
        verdict.write_text(json.dumps(judge(source, result.output).share))
    return Result(result.setting, result.mode, result.cost, result.output, json.loads(verdict.read_text()))


def _run(source: Path, setting: Setting, output: Path) -> None:
    """Write the output of the last command on that of the ones before it, which is kept like any other."""
    output.parent.mkdir(parents=True, exist_ok=True)
    *before, (tool, *options) = setting.commands
    given = made(source, Setting("core", tuple(before))).output if before else source
    target = output.with_name("unfinished.glb")
    files = ["-i", str(given), "-o", str(target)] if tool == PACK else [options.pop(0), str(given), str(target)]
    subprocess.run([command(tool), *files, *options], check=True, capture_output=True)
    target.rename(output)


def command(tool: str) -> str:
    """Return the path of a peer's command; raises RuntimeError with the install line where it is absent."""
    folders = [ROOT / "node_modules" / ".bin"]
    if chosen := os.environ.get("GLTF_PEERS_DIR"):
        folders = [Path(chosen), Path(chosen) / "node_modules" / ".bin", Path(chosen) / ".bin", *folders]
    found = next((str(folder / tool) for folder in folders if (folder / tool).is_file()), None) or shutil.which(tool)
    if found is None:
        raise RuntimeError(f"{tool} is not installed (npm install @gltf-transform/cli@4.5 gltfpack, or GLTF_PEERS_DIR)")
    return found


@cache
def version(tool: str) -> str:
    """Return what the peer says of itself."""
    run = subprocess.run([command(tool), "-v" if tool == PACK else "--version"], capture_output=True, text=True)
    return run.stdout.strip()


@cache
def _folder(source: Path, setting: Setting) -> Path:
    root = os.environ.get("GLTF_BENCH_CACHE") or Path(tempfile.gettempdir()) / "gltf-anim-peers"
    tools = [version(tool) for tool in sorted({one[0] for one in setting.commands})]
    about = json.dumps([_digest(source), tools, setting.commands])
    return Path(root) / source.stem / hashlib.sha256(about.encode()).hexdigest()[:16]


@cache
def _digest(source: Path) -> str:
    return hashlib.sha256(source.read_bytes()).hexdigest()


@cache
def _judge_version() -> str:
    scripts = b"".join(each.read_bytes() for each in SCRIPTS)
    return hashlib.sha256(scripts).hexdigest()[:8]
