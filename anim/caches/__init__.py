"""VertexCache ↔ bytes: one file and one row of `registry.CACHE_FORMATS` for every format."""
