"""Command lines on random rigs, and their outputs judged by the evaluator: stated errors and bounds are true."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from decimal import Decimal
from functools import partial
from random import Random

import numpy as np
from numpy.typing import NDArray

from tests.fuzz.execution import Job
from tests.fuzz.rigs.evaluation import Array, Evaluator
from tests.fuzz.rigs.rig import make_rig

NAME = "rig.glb"
MAX_ROUNDING = 3e-6  # of positions, of float32 along a chain, per largest coordinate
MAX_SAMPLED_FACTOR = 1.05  # of an error at any time, to the largest at samples
STEP_TOLERANCE = 4e-6  # s per s: jumps within it are not compared
MAX_TIMES = 400
UNITS_M = {"nm": 1e-9, "µm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0}
LINES = (
    "optimize rig.glb out.glb --max-error {error} --effort fast --jobs 1",
    "optimize rig.glb out.glb --max-error {error} --effort fast --jobs 1 --rebase-rest --drop rest",
    "optimize rig.glb out.glb --max-error {error} --effort fast --jobs 1 --player spec",
    "resample rig.glb out.glb --fps {fps}",
    "resample rig.glb out.glb --fps {fps} --interpolation cubicspline",
    "convert rig.glb out.glb",
    "retime rig.glb out.glb --speed 2.5",
    "retime rig.glb out.glb --reverse",
    "retime rig.glb out.glb --offset 0.75",
    "bake rig.glb out.npz --clip #0 --fps 12 --rigid",
    "bake rig.glb out.glb --clip #0 --fps 12 --rigid",
    "diff rig.glb other.glb --format json",
    "inspect rig.glb --format json",
    "check rig.glb --format json",
    "loop rig.glb --format json",
    "ease rig.glb out.glb --ease sine-in-out",
    "spline rig.glb out.glb",
)

Judge = Callable[[Sequence[str], str, bytes, Evaluator], list[str]]


def rig_job(chosen: Random) -> Job:
    """Return a command line on a random rig."""
    return _job(chosen.choice(LINES), chosen)


def warm_jobs() -> list[Job]:
    """Return a job for each command line."""
    return [_job(line, Random(f"warm {k}")) for k, line in enumerate(LINES)]


def _job(line: str, chosen: Random) -> Job:
    seed = chosen.getrandbits(32)
    files = {NAME: make_rig(seed)}
    if "other.glb" in line:
        files["other.glb"] = _with_noise(files[NAME], np.random.default_rng(seed))
    error = chosen.choice(["0.0001%", "0.01%", "0.1%", "1%", "5%"])
    words = line.format(error=error, fps=chosen.choice([3, 10, 30, 60]))
    return Job(words.split(), files)


def _with_noise(data: bytes, random: np.random.Generator) -> bytes:
    """The rig with other numbers at rest: its first node with a translation is elsewhere."""
    size = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + size])
    for node in document["nodes"]:
        if "translation" in node:
            node["translation"] = (np.array(node["translation"]) * random.uniform(0.9, 1.1, 3)).tolist()
            break
    content = json.dumps(document).encode()
    content += b" " * (-len(content) % 4)
    whole = data[12:20].replace(data[12:16], len(content).to_bytes(4, "little")) + content + data[20 + size :]
    return data[:8] + (12 + len(whole)).to_bytes(4, "little") + whole


def judge(line: Sequence[str], err: str, out: bytes) -> list[str]:
    """Return the faults of a command on a rig, in the current folder."""
    source = Evaluator(NAME)
    key = f"{line[0]} {line[2]}" if line[0] == "bake" else line[0]
    judged = JUDGES.get(key)
    return judged(line, err, out, source) if judged is not None else []


def _judge_bound(line: Sequence[str], err: str, out: bytes, source: Evaluator) -> list[str]:
    """The bound of `optimize` holds for all clips, in the players that it promises it for."""
    result, noise = Evaluator("out.glb"), MAX_ROUNDING * _size(source)
    fraction = float(line[line.index("--max-error") + 1].rstrip("%")) / 100
    players = (False,) if "--player" in line else (False, True)
    faults = []
    for clip in range(source.num_clips):
        bound = fraction * _diagonal(source)
        for nlerp in players:
            error = _largest_error(source, result, clip, nlerp=nlerp)
            if error > bound * 1.0005 + noise:
                faults.append(f"clip {clip}: error {error:.4g} m above the bound {bound:.4g} m")
    return faults


def _judge_stated(line: Sequence[str], err: str, out: bytes, source: Evaluator) -> list[str]:
    """The stated error, which is measured at samples, is nearly the true one."""
    result = Evaluator("out.glb")
    stated = _stated_error(err)
    error = max(_largest_error(source, result, clip) for clip in range(source.num_clips))
    limit = (stated or 0.0) * MAX_SAMPLED_FACTOR + MAX_ROUNDING * _size(source)
    return [f"error {error:.4g} m, stated {stated}"] if error > limit else []


def _judge_retime(line: Sequence[str], err: str, out: bytes, source: Evaluator) -> list[str]:
    """Poses are those of the source at other times."""
    result, faults = Evaluator("out.glb"), []
    for clip in range(source.num_clips):
        start, end = source.key_times(clip)[[0, -1]].tolist()
        rate, at_start = {"--speed": (2.5, start), "--reverse": (-1.0, end), "--offset": (1.0, start)}[line[3]]
        first = start + 0.75 if line[3] == "--offset" else start
        error = _largest_error(source, result, clip, rate=rate, first=first, original=at_start)
        limit = 10 * MAX_ROUNDING * _size(source) + 2 * _time_rounding(source, clip)
        faults += [f"clip {clip}: error {error:.4g} m"] * (error > limit)
    return faults


def _judge_cache(line: Sequence[str], err: str, out: bytes, source: Evaluator) -> list[str]:
    """Frames of a cache are the vertices at their times."""
    with np.load("out.npz") as file:
        times, positions = file["times"].astype(np.float64), file["positions"]
    is_sure = _apart_from_steps(source, 0, times)
    expected = np.concatenate(list(source.vertices(0, times).values()), axis=1)
    if expected.shape != positions.shape:
        return [f"shape {positions.shape}, expected {expected.shape}"]
    return _compare(positions, expected, is_sure, 10 * MAX_ROUNDING * _size(source))


def _judge_baked(line: Sequence[str], err: str, out: bytes, source: Evaluator) -> list[str]:
    """Morph targets of a bake give the vertices at the frames."""
    result, fps = Evaluator("out.glb"), float(line[line.index("--fps") + 1])
    start, end = source.key_times(0)[[0, -1]]
    times = start + np.arange(int((end - start) * fps + 1e-6) + 1) / fps
    own, baked = source.vertices(0, times), result.vertices(0 if result.num_clips else None, times)
    expected = np.concatenate(list(own.values()), axis=1)
    found = np.concatenate([baked[node] for node in own], axis=1)
    limit = 1.01 * (_stated_error(err) or 0.0) + 10 * MAX_ROUNDING * _size(source)
    return _compare(found, expected, _apart_from_steps(source, 0, times), limit)


def _judge_diff(line: Sequence[str], err: str, out: bytes, source: Evaluator) -> list[str]:
    """The largest difference of all clips, which is measured at samples, is nearly the true one."""
    other = Evaluator("other.glb")
    stated = max(each["max_error_m"] for each in json.loads(out)["clips"])
    error = max(_largest_error(source, other, clip) for clip in range(source.num_clips))
    limit = stated * MAX_SAMPLED_FACTOR + MAX_ROUNDING * _size(source)
    return [f"error {error:.4g} m, stated {stated:.4g} m"] if error > limit else []


JUDGES: dict[str, Judge] = {
    "optimize": _judge_bound,
    "resample": _judge_stated,
    "convert": _judge_stated,
    "retime": _judge_retime,
    "bake out.npz": _judge_cache,
    "bake out.glb": _judge_baked,
    "diff": _judge_diff,
}


def _stated_error(err: str) -> float | None:
    """The largest error in the words of a command, in metres, at the end of its rounding; None without one."""
    found = re.findall(r"max (?:at least )?(\S+) (nm|µm|mm|cm|m)\b", err)
    if not found:
        return None
    number = Decimal(found[-1][0])
    half = Decimal(5).scaleb(int(number.as_tuple().exponent) - 1)
    return float(number + half) * UNITS_M[found[-1][1]]


def _compare(found: Array, expected: Array, is_sure: NDArray[np.bool_], limit: float) -> list[str]:
    if found.shape != expected.shape:
        return [f"shape {found.shape}, expected {expected.shape}"]
    error = np.linalg.norm(found - expected, axis=2)[is_sure].max(initial=0.0)
    return [f"error {error:.4g} m (limit {limit:.4g})"] if error > limit else []


def _largest_error(
    source: Evaluator,
    result: Evaluator,
    clip: int,
    *,
    nlerp: bool = False,
    rate: float = 1.0,
    first: float = 0.0,
    original: float = 0.0,
) -> float:
    """Largest distance of a vertex over the clip of the result, at its keys, between them, and on a fine grid.

    rate, first, original: the time t of the result is that at original + rate · (t − first) in the source.
    """

    def to_source(times: Array) -> Array:
        return original + rate * (times - first)

    keys = result.key_times(clip)
    times = np.unique(np.concatenate((keys, (keys[1:] + keys[:-1]) / 2, np.linspace(keys[0], keys[-1], MAX_TIMES))))
    is_sure = _apart_from_steps(result, clip, times) & _apart_from_steps(source, clip, to_source(times))
    times = times[is_sure]
    if not len(times):
        return 0.0
    before = source.vertices(clip, to_source(times), nlerp=nlerp)
    after = result.vertices(clip, times, nlerp=nlerp)
    assert before.keys() == after.keys()
    return max(float(np.linalg.norm(after[i] - before[i], axis=2).max()) for i in before)


def _time_rounding(source: Evaluator, clip: int) -> float:
    """Largest motion of a vertex within the rounding of times to float32."""
    start, end = source.key_times(clip)[[0, -1]]
    times = np.linspace(start, end, MAX_TIMES)
    times = times[_apart_from_steps(source, clip, times)]
    spacing = float(np.spacing(np.float32(end)))
    early, late = (source.vertices(clip, times + shift) for shift in (-spacing, spacing))
    return max(float(np.linalg.norm(late[i] - early[i], axis=2).max(initial=0.0)) for i in early)


def _apart_from_steps(file: Evaluator, clip: int, times: Array) -> NDArray[np.bool_]:
    """Mask of times at which no STEP key is."""
    steps = file.key_times(clip, ("STEP",))
    if not len(steps):
        return np.ones(len(times), bool)
    distance = np.abs(times[:, None] - steps).min(axis=1)
    return np.asarray(distance > STEP_TOLERANCE * (1 + np.abs(times)))


def _diagonal(file: Evaluator) -> float:
    """Diagonal of the box around the meshes at rest."""
    points = np.concatenate([each.reshape(-1, 3) for each in file.vertices(None, np.zeros(1)).values()])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _size(file: Evaluator) -> float:
    """Largest coordinate of all clips, or the diagonal: the scale of rounding."""
    poses: list[Array] = []
    for clip in range(file.num_clips):
        poses += partial(file.vertices, clip)(file.key_times(clip)[:50]).values()
    return max(_diagonal(file), *(float(np.abs(each).max()) for each in poses))
