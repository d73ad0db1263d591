"""What a run of the command line leaves behind, and how to start one in a process of its own."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import subprocess
import sys
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import fixtures

ROOT = Path(__file__).resolve().parents[2]
# The folder of the installed command comes first, so that shell lines find it; compiled modules are kept, as users do.
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
ENVIRONMENT.pop("PYTHONDONTWRITEBYTECODE", None)
TIMEOUT = 180  # s, for one process on a busy machine


class Run(NamedTuple):
    """Exit code, bytes on stdout, and text on stderr."""

    code: int
    out: bytes
    err: str

    @property
    def text(self) -> str:
        """Stdout as text."""
        return self.out.decode()

    @property
    def json(self) -> Any:
        """Stdout as the one JSON document that it must be: UTF-8, no NaN, nothing after it."""
        return json.loads(self.out.decode(), parse_constant=_refused)

    def product(self) -> bytes:
        """Return stdout of a run that must have succeeded."""
        assert self.code == 0, self.err
        return self.out


@cache
def built(name: str) -> bytes:
    """Return the bytes of a fixture, built once for all tests."""
    return fixtures.build(name)


def shell(line: str, folder: Path) -> Run:
    """Run a line of bash in a folder; a failure anywhere in a pipe is the line's own, as with `set -o pipefail`."""
    run = subprocess.run(
        ["bash", "-o", "pipefail", "-c", line],
        cwd=folder,
        env=ENVIRONMENT,
        capture_output=True,
        stdin=subprocess.DEVNULL,
        timeout=TIMEOUT,
        check=False,
    )
    return Run(run.returncode, run.stdout, run.stderr.decode())


def started(*args: str | Path, stdin: int | None = None, stdout: int | None = None) -> subprocess.Popen[bytes]:
    """Return the command in a process of its own, to be watched and stopped."""
    command = [str(Path(sys.executable).parent / "gltf-anim"), *map(str, args)]
    return subprocess.Popen(command, env=ENVIRONMENT, stdin=stdin, stdout=stdout, stderr=subprocess.PIPE)


def refusal(run: Run, code: int) -> str:
    """Return the first line of a refusal, after checking its manners: exit code, no product, a line and maybe help."""
    assert run.code == code, run.err
    assert run.out == b""
    lines = run.err.splitlines()
    assert run.err.endswith("\n")
    assert len(lines) in (1, 2), run.err
    assert lines[0].startswith("gltf-anim: ")
    assert all(line.startswith("help: ") for line in lines[1:]), run.err
    assert all(line.isprintable() for line in lines), run.err
    return lines[0]


def help_line(run: Run) -> str:
    """Return the second line of a refusal without "help: "; empty where there is none."""
    lines = run.err.splitlines()
    return lines[1].removeprefix("help: ") if len(lines) > 1 else ""


def table(content: bytes) -> list[dict[str, str]]:
    """Return rows of a CSV by the header's names, after checking that it is one table."""
    header, *rows = csv.reader(io.StringIO(content.decode(), newline=""))
    assert {len(row) for row in rows} <= {len(header)}
    assert len(set(header)) == len(header)
    return [dict(zip(header, row, strict=True)) for row in rows]


def _refused(name: str) -> float:
    raise AssertionError(f"JSON holds {name}")


def stated_length(err: str) -> float:
    """Return the error of a summary in metres, as "max 0.41 mm", and half of its last digit."""
    found = re.search(r"max (\S+) (nm|µm|mm|cm|m)\b", err)
    assert found is not None
    digits = Decimal(found[1])
    half = Decimal(5).scaleb(int(digits.as_tuple().exponent) - 1)
    return float(digits + half) * {"nm": 1e-9, "µm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0}[found[2]]
