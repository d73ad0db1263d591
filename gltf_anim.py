"""Entry point of the installed command, under a name that other projects don't have.

Folders of $PYTHONPATH come before installed packages, and a folder that is there for another project may hold a
`cli.py` or an `anim` of its own: both packages are imported from beside this file.
"""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line of this process and exit with its exit code."""
    beside = os.path.dirname(os.path.abspath(__file__))
    sys.path.insert(0, beside)
    try:
        import anim  # noqa: F401
        from cli.entry_point import main as run
    finally:
        sys.path.remove(beside)
    run()
