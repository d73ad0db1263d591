"""`python -m anim`: the command `gltf-anim`, without modules of the current folder."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line of this process and exit with its exit code."""
    if sys.path[0] in ("", os.getcwd()) and not os.path.samefile(os.curdir, _root()):
        del sys.path[0]  # where Python puts the current folder, whatever it holds
    from gltf_anim import main as run

    run()


def _root() -> str:
    return os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


if __name__ == "__main__":
    main()
