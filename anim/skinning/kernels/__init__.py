"""The loops of all methods, one a file, compiled by numba (`jit`).

Frames are the innermost axis, LANES of them, so that every step is a multiply-add along a row and nothing is gathered
twice. Row views (a = matrices[j]) and plain loop variables let the compiler see that; computed indices cost 5×.

Kernels that skin take the vertices first … last and write them into columns at + v. A vertex without any influence
goes to the origin, as its sum says. Arguments that are None leave out what belongs to them already when a kernel is
compiled. These modules load numba, so they are imported where they are called; `layout` doesn't.
"""
