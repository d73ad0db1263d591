"""Entry point of the installed command, and of `python -m anim`."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line of this process and exit with its exit code.

    Folders of $PYTHONPATH come before installed packages, and one that is there for another project often has a
    `cli.py`: `cli` is imported from beside this package.
    """
    beside = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    sys.path.insert(0, beside)
    try:
        from cli.entry_point import main as run
    finally:
        sys.path.remove(beside)
    run()


if __name__ == "__main__":
    main()
