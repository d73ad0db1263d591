"""Workflow of `run`: recipes of settings over many files, with a cache, a journal, and worker processes."""
