"""Kernels as machine code, made when they are first used; kept code needs no numba, which costs more than a bake."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from functools import cache
from threading import Lock
from types import FunctionType
from typing import Any, TypeAlias, cast

import numpy as np

from anim.skinning import kept
from anim.skinning.machine_code import LAYOUT, RESULTS, MachineCode, function, kinds, laid_out, machine

Kernel: TypeAlias = Callable[..., Any]

ROOM = __name__.rpartition(".")[0]
NUMBERS = (int, float, np.generic)
HOW = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
# What a numba with other insides leads to, and an LLVM that can't load what it made.
UNLIKE = (AttributeError, ImportError, RuntimeError, TypeError, ValueError)
_one_at_a_time = Lock()  # numba and LLVM are asked by one thread


@cache
def compiled(kernel: Kernel) -> Kernel:
    """Return a plain function over arrays, with those of this room that it calls, as code free of Python's lock.

    Its parameters are arrays, tuples of arrays, int and float; it returns an int, a bool or nothing. It must not make
    arrays: nothing counts who uses them, which takes half the time of a loop over rows, and more where threads share
    the counts. Nor may it raise. Without fast-math: sums and products come out the same on every machine.
    Code is kept in the user's cache folder (or $NUMBA_CACHE_DIR), wherever the package lies, under a name made of its
    source; it is made anew in each process where there is no such folder.
    """
    ready: dict[str, Kernel] = {}

    def call(*arguments: Any) -> int:
        kind = kinds(arguments)
        if kind not in ready:
            with _one_at_a_time:
                if kind not in ready:
                    ready[kind] = _ready(kernel, kind, arguments)
        return int(ready[kind](arguments) or 0)

    return call


def _ready(kernel: Kernel, kind: str, arguments: tuple[Any, ...]) -> Kernel:
    """What runs a kernel, given all its arguments as one tuple."""
    try:
        found = function(_code(kernel, kind, arguments), laid_out(arguments))
    except UNLIKE:
        usual = _by_numba(kernel)
        return lambda given: usual(*given)
    return lambda given: found(*laid_out(given))


def _code(kernel: Any, kind: str, arguments: tuple[Any, ...]) -> MachineCode:
    name = f"{kernel.__name__}-{_digest(kernel, kind)}"
    code = kept.read(name)
    if code is None:
        code = _made(kernel, arguments)
        kept.write(name, code)
    return code


def _made(kernel: Any, arguments: tuple[Any, ...]) -> MachineCode:
    """What numba makes of a kernel for arguments of these types."""
    import numba

    types = tuple(numba.typeof(each) for each in arguments)
    fast = numba.njit(**HOW)(_linked(kernel, _inlined))
    fast.compile(types)
    library, symbol = fast.overloads[types].library, fast.overloads[types].fndesc.llvm_func_name
    taken, given = len(list(library.get_function(symbol).arguments)), len(laid_out(arguments)) + RESULTS
    if taken != given:
        raise ValueError(f"numba {numba.__version__} made '{symbol}' with {taken} parameters (expected {given})")
    _, _, (object_file, _) = library.serialize_using_object_code()
    return MachineCode(symbol, object_file)


def _by_numba(kernel: Kernel) -> Kernel:
    """The kernel as numba itself runs it: slower, larger, and the same numbers."""
    import numba

    def plain(function: Kernel) -> Kernel:
        return cast(Kernel, numba.njit(nogil=True, error_model="numpy")(_linked(function, plain)))

    return plain(kernel)


@cache
def _inlined(helper: Kernel) -> Kernel:
    import numba

    return cast(Kernel, numba.njit(**HOW, forceinline=True)(_linked(helper, _inlined)))  # rows of known length go fast


def _linked(function: Any, link: Callable[[Kernel], Kernel]) -> Kernel:
    """The function with compiled ones in place of those that it calls."""
    known = {**function.__globals__, **{each.__name__: link(each) for each in _called(function)}}
    copy = FunctionType(function.__code__, known, function.__name__)
    copy.__module__ = function.__module__
    return copy


def _called(function: Any) -> Iterator[Any]:
    for name in function.__code__.co_names:
        found = function.__globals__.get(name)
        if isinstance(found, FunctionType) and found.__module__.startswith(ROOM):
            yield found


def _digest(kernel: Any, kind: str) -> str:
    """What tells code for one machine, kind of arguments and source, with all that it calls, from another."""
    found, ahead = hashlib.sha256(repr((machine(), LAYOUT, kind, HOW)).encode()), [kernel]
    while ahead:
        function = ahead.pop()
        code, known = function.__code__, function.__globals__
        values = [known[name] for name in code.co_names if isinstance(known.get(name), NUMBERS)]
        found.update(code.co_code + repr((code.co_names, code.co_consts, values)).encode())
        ahead.extend(_called(function))
    return found.hexdigest()[:24]
