"""Rigid bodies: descriptions in a file or by globs, the world they make, and their motion."""
