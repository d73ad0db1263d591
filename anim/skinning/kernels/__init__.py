"""Numba kernels of all methods, one per module (`jit`).

Frames are the innermost axis, LANES of them, so that every step is a multiply-add along a row without repeated
gathers. Row views (a = matrices[j]) and plain loop variables let the compiler see that; computed indices cost 5×.

Kernels that skin take the vertices first … last and write them into columns at + v. A vertex without any influence
goes to the origin, the value of its sum. Arguments that are None remove their code at compile time. These modules load
numba, so they are imported where they are called; `layout` doesn't.
"""
