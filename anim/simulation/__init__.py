"""Motion that follows from forces, written as keys: springs, particles, cloth, rigid bodies."""
