"""Pictures as escape sequences of terminals."""
