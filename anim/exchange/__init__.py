"""Euler tracks in and out: BVH, CSV and JSON curves, and what they become in glTF."""
