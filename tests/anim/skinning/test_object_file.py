"""Code that is loaded without LLVM against the same code loaded by it, and what is refused."""

from __future__ import annotations

import math
import platform
import sys
from collections.abc import Callable
from pathlib import Path
from struct import pack_into, unpack_from

import llvmlite.binding as llvm
import pytest

from anim.skinning import machine_code
from anim.skinning.machine_code import MachineCode, function
from anim.skinning.object_file import loaded

pytestmark = pytest.mark.skipif(
    (sys.platform, platform.machine()) != ("linux", "x86_64"), reason="elsewhere LLVM loads all"
)

POLYNOMIAL = """
define i32 @polynomial(ptr %result, ptr %problem, double %x) {
  %a = fmul double %x, 3.25
  %b = fadd double %a, 0x400921FB54442D18
  %e = call double @exp(double %b)
  %i = fptosi double %e to i64
  store i64 %i, ptr %result
  ret i32 0
}
declare double @exp(double)
"""
COUNTER = """
@count = global i64 5
define i32 @counter(ptr %result, ptr %problem, double %x) {
  store ptr @count, ptr %result
  ret i32 0
}
"""


def _object(text: str, *, model: str = "large") -> bytes:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(codemodel=model, reloc="static", opt=2)
    return bytes(machine.emit_object(llvm.parse_assembly(text)))


@pytest.fixture(params=["own", "llvm"])
def run(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Callable[[float], int]:
    if request.param == "llvm":

        def refused(*_: object) -> int:
            raise ValueError("not this time")

        monkeypatch.setattr(machine_code, "loaded", refused)
    return function(MachineCode("polynomial", _object(POLYNOMIAL)), [1.0])


def test_code_with_constants_and_functions_of_c(run: Callable[[float], int]) -> None:
    for x in (-1.0, 0.5, 2.25):
        assert run(x) == int(math.exp(3.25 * x + math.pi))


def test_memory_of_code_can_be_run_and_not_written_to() -> None:
    address = loaded(_object(POLYNOMIAL), "polynomial")
    for line in Path("/proc/self/maps").read_text().splitlines():
        ends, rights, *_ = line.split()
        low, high = (int(each, 16) for each in ends.split("-"))
        if low <= address < high:
            assert rights == "r-xp"
            return
    pytest.fail("nowhere")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not ELF"),
        (b"MZ" + bytes(100), "not ELF"),
        (_object(COUNTER), "memory to write to"),
        (_object(POLYNOMIAL, model="small"), "relocation is of type"),
        (_object(POLYNOMIAL.replace("@exp", "@no_such_function")), "no function 'no_such_function'"),
    ],
    ids=["nothing", "another format", "data", "another code model", "unknown function"],
)
def test_what_is_not_foreseen_is_refused(content: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        loaded(content, "polynomial")


def test_what_is_cut_off_or_changed_is_refused_or_is_the_same() -> None:
    """A file is sealed where it is kept; here any error but the promised ones would show as another kind."""
    content = _object(POLYNOMIAL)
    for end in range(0, len(content), 7):
        with pytest.raises(ValueError, match=r"object file|is not in|not enough values|buffer"):
            loaded(content[:end], "polynomial")
    flat = bytearray(content)
    (at,) = unpack_from("<Q", content, 40)
    for i in range(content[60]):
        pack_into("<Q", flat, at + 64 * i + 48, 0)  # "0 and 1 mean that there is no constraint on alignment"
    assert loaded(bytes(flat), "polynomial")


def test_another_machines_code_is_refused() -> None:
    content = bytearray(_object(POLYNOMIAL))
    pack_into("<H", content, 18, 183)  # AArch64
    with pytest.raises(ValueError, match="not ELF for x86-64"):
        loaded(bytes(content), "polynomial")


def test_a_name_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="is not in"):
        loaded(_object(POLYNOMIAL), "binomial")


def test_other_systems_are_left_to_llvm(monkeypatch: pytest.MonkeyPatch) -> None:
    code = MachineCode("polynomial", _object(POLYNOMIAL))
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(OSError, match="darwin"):
        loaded(code.object, code.symbol)
    assert function(code, [1.0])(0.0) == 23


def test_what_a_machine_can_do_is_known_without_llvm_and_else_by_it(monkeypatch: pytest.MonkeyPatch) -> None:
    system, processor, *about = machine_code.machine()
    assert (system, processor) == ("linux", "x86_64")
    assert {"fpu", "sse2"} <= set(" ".join(about).split())
    assert {each.partition(":")[0] for each in about} == {"cpu family", "flags", "model", "vendor_id"}
    monkeypatch.setattr(machine_code, "CPUS", Path("/no/such/file"))
    assert "sse2" in machine_code.machine()[2]
