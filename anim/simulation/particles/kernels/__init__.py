"""Kernels of particles, compiled by numba: each particle by itself, so the result has no order."""
