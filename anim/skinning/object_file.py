"""Machine code out of an object file into memory that may run. LLVM's library can do it too, and takes 50 MB.

Of ELF for x86-64 this knows what a kernel needs: code, constants, and places for their addresses. Whatever else a file
asks for is refused.
Source: System V ABI, chapter 4, "Object Files"; its AMD64 supplement, 4.4, "Relocation".
"""

from __future__ import annotations

import ctypes
import mmap
import os
import platform
import sys
from struct import error, unpack_from
from typing import Any

import numpy as np

KIND, X86_64 = b"\x7fELF\x02\x01\x01", 62  # 64 bits, little-endian, version 1
CONTENT, SYMBOLS, PLACES = 1, 2, 4  # types of sections: SHT_PROGBITS, SHT_SYMTAB, SHT_RELA
WRITABLE, LOADED = 1, 2  # flags of sections: SHF_WRITE, SHF_ALLOC
ELSEWHERE = 0  # SHN_UNDEF, the section of a symbol that the file only names
ADDRESS = 1  # R_X86_64_64: in this place goes the address of a symbol, plus an addend
READ, RUN = 1, 4  # what memory may be used for

SECTION = np.dtype("u4, u4, u8, u8, u8, u8, u4, u4, u8, u8")
SECTION.names = ("name", "type", "flags", "address", "offset", "size", "link", "info", "alignment", "entry")
SYMBOL = np.dtype("u4, u2, u2, u8, u8")
SYMBOL.names = ("name", "info", "section", "value", "size")
PLACE = np.dtype("u8, u4, u4, i8")
PLACE.names = ("offset", "type", "symbol", "addend")

_kept: list[mmap.mmap] = []  # nobody tells when code is called for the last time


def loaded(content: bytes, name: str) -> int:
    """Return the address of a function in an object file, in memory of its own that stays until the process ends.

    Raises ValueError for content that isn't as foreseen here, OSError where such code can't run.
    """
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        raise OSError(f"this is {sys.platform} on {platform.machine()} (expected linux on x86_64)")
    try:
        return _loaded(_File(content), name)
    except (ArithmeticError, IndexError, error) as problem:
        raise ValueError(f"object file is not whole ({problem})") from None


def _loaded(file: _File, name: str) -> int:
    memory = mmap.mmap(-1, file.size, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    base = np.frombuffer(memory, np.uint8).ctypes.data
    file.place(memory, base)
    _let_run(base, file.size)
    _kept.append(memory)
    return file.address(file.names.index(name), base)


class _File:
    """What is in an object file, and where its parts go in `size` bytes of memory. names: of its symbols."""

    def __init__(self, content: bytes) -> None:
        if content[: len(KIND)] != KIND or unpack_from("<H", content, 18) != (X86_64,):
            raise ValueError("object file is not ELF for x86-64")
        (at,), (count,) = unpack_from("<Q", content, 40), unpack_from("<H", content, 60)
        self._content = content
        self._sections = np.frombuffer(content, SECTION, count, at)
        self._starts, self.size = self._laid_out()
        (table,) = self._sections[self._sections["type"] == SYMBOLS]
        self._symbols = np.frombuffer(self._bytes(table), SYMBOL)
        text = self._bytes(self._sections[table["link"]])
        self.names = [text[start:].partition(b"\0")[0].decode() for start in self._symbols["name"]]

    def place(self, memory: mmap.mmap, base: int) -> None:
        """Put all that is needed into memory that begins at an address."""
        for i, start in self._starts.items():
            part = self._bytes(self._sections[i])
            memory[start : start + len(part)] = part
        for section in self._sections[self._sections["type"] == PLACES]:
            if section["info"] in self._starts:
                for place in np.frombuffer(self._bytes(section), PLACE):
                    self._fill(memory, base, self._starts[section["info"]] + int(place["offset"]), place)

    def address(self, symbol: int, base: int) -> int:
        """Return where a symbol is in memory that begins at an address, or where C's own library has it."""
        section = int(self._symbols["section"][symbol])
        if section == ELSEWHERE:
            return _of_c(self.names[symbol])
        if section not in self._starts:
            raise ValueError(f"'{self.names[symbol]}' is in section {section} (expected one with code or constants)")
        return base + self._starts[section] + int(self._symbols["value"][symbol])

    def _fill(self, memory: mmap.mmap, base: int, at: int, place: Any) -> None:
        if place["type"] != ADDRESS:
            raise ValueError(f"relocation is of type {place['type']} (expected {ADDRESS})")
        address = self.address(int(place["symbol"]), base) + int(place["addend"])
        memory[at : at + 8] = address.to_bytes(8, "little")

    def _laid_out(self) -> tuple[dict[int, int], int]:
        starts, end = {}, 0
        for i, section in enumerate(self._sections):
            if section["flags"] & LOADED and section["size"]:
                if section["flags"] & WRITABLE:
                    raise ValueError("object file has memory to write to (expected code and constants)")
                if section["type"] == CONTENT:  # others tell debuggers how to leave a function
                    starts[i] = -(-end // (each := max(int(section["alignment"]), 1))) * each
                    end = starts[i] + int(section["size"])
        return starts, end

    def _bytes(self, section: Any) -> bytes:
        return self._content[section["offset"] :][: section["size"]]


def _of_c(name: str) -> int:
    found = getattr(ctypes.CDLL(None), name, None)
    address = ctypes.cast(found, ctypes.c_void_p).value if found else None
    if address is None:
        raise ValueError(f"there is no function '{name}'")
    return address


def _let_run(base: int, size: int) -> None:
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    if protect(ctypes.c_void_p(base), ctypes.c_size_t(size), READ | RUN):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
