"""Machine code out of an object file, called with arrays: what numba makes, without numba in memory."""

from __future__ import annotations

import ctypes
import platform
import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from anim.skinning.object_file import loaded

Numbers: TypeAlias = "list[int | float]"

CPUS, ONE_CPU = Path("/proc/cpuinfo"), 8192  # where Linux says what its processors can do; characters for one
CPU = re.compile(r"^(vendor_id|cpu family|model|flags|Features|CPU part)\s*:(.*)$", re.MULTILINE)
LAYOUT = 1  # of arguments; with another one kept code is made anew
RESULTS = 2  # parameters before the arguments: where the result goes, and where an exception does


@dataclass(frozen=True, slots=True)
class MachineCode:
    """An object file, and the name of the function in it. It may need nothing but what C's own library has."""

    symbol: str
    object: bytes


def kinds(arguments: Iterable[Any]) -> str:
    """Return what the code for some arguments must be made for: types of numbers and arrays, layouts, not sizes.

    kinds((7, zeros((2, 3)))) → "int,<f82Cw"
    """
    return ",".join(map(_kind, arguments))


def laid_out(arguments: Iterable[Any]) -> Numbers:
    """Return the numbers that a function of numba's takes in place of its arguments.

    An array is two places for owners that are not counted here, its count and size of items, address, shape and
    strides; a tuple is its parts.
    Source: numba's `core/datamodel/models.py`, ArrayModel, and `core/callconv.py`.
    """
    numbers: Numbers = []
    _add(numbers, arguments)
    return numbers


def function(code: MachineCode, numbers: Numbers) -> Callable[..., int]:
    """Return the function, for as many numbers and of such types as these; it runs free of Python's lock.

    It returns what the kernel does: an integer or a truth value, 0 for nothing.
    """
    types = (ctypes.c_double if isinstance(number, float) else ctypes.c_int64 for number in numbers)
    kind = ctypes.CFUNCTYPE(ctypes.c_int32, *[ctypes.c_void_p] * RESULTS, *types)
    enter = kind(_address(code))

    def call(*given: int | float) -> int:
        result, problem = ctypes.c_int64(), ctypes.c_void_p()
        if enter(ctypes.addressof(result), ctypes.addressof(problem), *given):
            raise RuntimeError(f"'{code.symbol}' raised an exception (expected a kernel that can't)")
        return result.value

    return call


def machine() -> tuple[str, ...]:
    """Return what code is made for: the system, the processor, and what it can do."""
    try:
        with CPUS.open(errors="replace") as file:
            first = file.read(ONE_CPU).partition("\n\n")[0]  # a system with many takes long to list them
    except OSError:
        first = ""
    found = dict(CPU.findall(first))
    if found.keys() & {"flags", "Features"}:
        return sys.platform, platform.machine(), *(f"{key}:{found[key]}" for key in sorted(found))
    import llvmlite.binding as llvm

    return llvm.get_process_triple(), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _address(code: MachineCode) -> int:
    try:
        return loaded(code.object, code.symbol)
    except (OSError, ValueError):
        return _address_by_llvm(code)


def _address_by_llvm(code: MachineCode) -> int:
    import llvmlite.binding as llvm

    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(code.object))
    engine.finalize_object()
    return int(engine.get_function_address(code.symbol))


@cache
def _engine() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple().create_target_machine()
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), target)


def _kind(value: Any) -> str:
    if isinstance(value, np.ndarray):
        flags = value.flags
        layout = "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A"
        return f"{value.dtype.str}{value.ndim}{layout}{'w' if flags.writeable else 'r'}"
    name = type(value).__name__
    return f"{name}({kinds(value)})" if isinstance(value, tuple) else name


def _add(numbers: Numbers, arguments: Iterable[Any]) -> None:
    for value in arguments:
        if isinstance(value, np.ndarray):
            address = value.__array_interface__["data"][0]
            numbers += (0, 0, value.size, value.itemsize, address, *value.shape, *value.strides)
        elif isinstance(value, tuple):
            _add(numbers, value)
        else:
            numbers.append(value)
