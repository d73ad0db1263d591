"""Skinning methods beyond glTF's linear blending, baked to vertex caches, and analysis of collapse."""
