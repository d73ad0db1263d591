"""Files by path: memory-mapped, confined to a folder, and written atomically."""
