"""Skinning methods that glTF can't play, baked to vertex caches; and how much linear blending loses."""
