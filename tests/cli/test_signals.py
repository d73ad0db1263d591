"""Signals while the program starts, and signals that a package turned into another error."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from cli import errors, signals
from tests.cli.running import ENVIRONMENT, ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has other signals")


def python(code: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=False, timeout=60
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("where", ["cli.entry_point", "cli.main", "anim.gltf.io.container"])
def test_a_signal_during_imports_ends_silently(where: str, number: signal.Signals) -> None:
    run = python(f"import cli.entry_point, {where}, os; os.kill(os.getpid(), {int(number)}); print('went on')")
    assert (run.returncode, run.stdout, run.stderr) == (-number, b"", b"")


def test_the_library_is_imported_before_the_handlers_are_set_and_imports_nothing() -> None:
    run = python("import sys; before = set(sys.modules); import anim; print(*sorted(set(sys.modules) - before))")
    assert run.stdout.split() == [b"anim"]


@pytest.mark.parametrize(("number", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
@pytest.mark.parametrize("fate", ["turned into another error", "swallowed", "lost before an error", "passed on"])
def test_a_signal_ends_the_run_whatever_a_package_makes_of_it(fate: str, number: str, code: int) -> None:
    catch = {
        "turned into another error": "except BaseException as e: raise RuntimeError('in __set_name__') from e",
        "swallowed": "except BaseException: pass",
        "lost before an error": "except BaseException: pass\n        raise RuntimeError('no compiled object yet')",
        "passed on": "finally: pass",
    }[fate]
    run = python(f"""
import sys
sys.argv = ["gltf-anim", "convert", "x.glb"]
from cli import entry_point, main
from cli.commands import convert
import os, signal
def job(args, received):
    from cli import errors
    def fails():
        try: os.kill(os.getpid(), signal.{number})
        {catch}
    return errors.run_guarded(fails, args, received)
main.run = job
entry_point.main()
""")
    assert (run.returncode, run.stderr) == (code, b"")


def test_ignored_signals_stay_ignored() -> None:
    usual = signal.signal(signal.SIGHUP, signal.SIG_IGN), signal.getsignal(signal.SIGINT), signal.getsignal(15)
    try:
        signals.install_handlers()
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        for each, handler in zip((signal.SIGHUP, signal.SIGINT, signal.SIGTERM), usual, strict=True):
            signal.signal(each, handler)


def test_an_error_after_a_signal_has_the_signals_code() -> None:
    def fails() -> None:
        try:
            raise SystemExit(143)
        except SystemExit as error:
            raise RuntimeError("Error calling __set_name__") from error

    assert errors.run_guarded(fails) == 143
    assert os.getpid()
