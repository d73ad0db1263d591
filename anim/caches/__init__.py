"""VertexCache ↔ bytes: one file and one row of `formats.CACHE_FORMATS` for every format."""
