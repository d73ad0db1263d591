"""Files by path: read, confined to a folder, and written atomically."""
