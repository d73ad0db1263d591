"""Kernels of cloth, compiled by numba."""
