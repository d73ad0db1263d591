"""Whole processes, measured from outside: wall time and peak memory."""

from __future__ import annotations

import os
import statistics
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass
class Measured:
    """One command line and what its runs took: seconds of wall time, and bytes of peak memory of the process itself.

    A process that only starts another one to do the work would show the memory of the starter.
    """

    name: str
    command: Sequence[str]
    seconds: list[float] = field(default_factory=list)
    peak: list[int] = field(default_factory=list)

    @property
    def median_s(self) -> float:
        """Median wall time."""
        return statistics.median(self.seconds)

    @property
    def median_peak(self) -> float:
        """Median of peak memory."""
        return statistics.median(self.peak)


def interleaved(commands: Mapping[str, Sequence[str]], *, runs: int) -> dict[str, Measured]:
    """Return every command measured `runs` times in turn, after one run of each that is thrown away."""
    found = {name: Measured(name, command) for name, command in commands.items()}
    for each in found.values():
        _run(each.command)
    for _ in range(runs):
        for each in found.values():
            seconds, peak = _run(each.command)
            each.seconds.append(seconds)
            each.peak.append(peak)
    return found


def environment() -> dict[str, str]:
    """What users have: compiled Python modules are kept."""
    return {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}


def _run(command: Sequence[str]) -> tuple[float, int]:
    began = time.perf_counter()
    process = subprocess.Popen(command, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)}: exit code {process.returncode}")
    return seconds, usage.ru_maxrss * 1024
