"""Euler motion ↔ glTF: BVH, CSV and JSON curves, and retargeting to characters."""
