"""Files by path: mapped, confined to a folder, and replaced whole. Nothing else in the library opens a path."""
