"""The loops of all methods, one a file. Plain functions over arrays: `compiled` makes machine code of them.

Frames are the innermost axis, LANES of them, so that every step is a multiply-add along a row and nothing is gathered
twice. Row views (a = matrices[j]) and plain loop variables let the compiler see that; computed indices cost 5×, and
counting who uses a view costs twice the time (measured), so nothing is counted, no array is made inside, and kernels
work in a Room they are given. `worlds` comes before them all: it is about nodes.

Kernels that skin take the vertices first … last and write them into columns at + v of a Target. A vertex without any
influence goes to the origin, as its sum says.
"""
