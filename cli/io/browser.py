"""A page shown in the browser without a file: one answer on the loopback address, then the server is gone.

Browsers in a sandbox, such as Ubuntu's Firefox, don't see files in the temporary folder.
"""

from __future__ import annotations

import http.server
import secrets
import threading
import time
import webbrowser
from collections.abc import Callable

MAX_WAIT_S = 20.0  # for a browser to fetch the page
POLL_S = 0.2
PATH_BYTES = 16  # random, so that other programs of the machine can't guess the address


def show_once(page: bytes, *, open_url: Callable[[str], object] = webbrowser.open, wait: float = MAX_WAIT_S) -> bool:
    """Open a page in the browser; return False if it did not fetch the page within `wait` seconds."""
    path = f"/{secrets.token_urlsafe(PATH_BYTES)}.html"
    served: list[bool] = []

    class Once(http.server.BaseHTTPRequestHandler):
        timeout = wait  # of a connection that sends nothing

        def do_GET(self) -> None:
            """Answer the page's address once, and nothing else."""
            if self.path != path or served:
                self.send_error(404)
                return
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(page)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(page)
            served.append(True)

        def log_message(self, *_: object) -> None:
            """Write nothing: stderr is for messages."""

    with http.server.HTTPServer(("127.0.0.1", 0), Once) as server:
        address = f"http://127.0.0.1:{server.server_port}{path}"
        opened: list[object] = []
        # Beside the server: some commands in $BROWSER end with the browser only
        threading.Thread(target=lambda: opened.append(open_url(address)), daemon=True).start()
        end = time.monotonic() + wait
        while not served and (not opened or opened[0]) and (left := end - time.monotonic()) > 0:
            server.timeout = min(left, POLL_S)
            server.handle_request()  # a favicon may be asked for first
    return bool(served)
