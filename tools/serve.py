"""Serve a folder to a browser on this machine, for `make demo`; runs with any Python 3.

Usage: `python3 tools/serve.py FOLDER [--port PORT]`.
"""

import argparse
import functools
import os
import sys
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


class Folder(SimpleHTTPRequestHandler):
    """Files inside the folder only, also where a link leads out of it."""

    def send_head(self) -> Any:
        """Answer with a file, unless it or the index of a folder lies elsewhere."""
        asked, root = self.translate_path(self.path), os.path.realpath(self.directory)
        for path in (asked, f"{asked}/index.html", f"{asked}/index.htm"):
            if "\0" in path or os.path.commonpath([root, os.path.realpath(path)]) != root:
                self.send_error(HTTPStatus.NOT_FOUND)
                return None
        return super().send_head()


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Serve a folder on this machine.")
    parser.add_argument("folder")
    parser.add_argument("--port", type=int, default=8000)
    given = parser.parse_args()
    handler = functools.partial(Folder, directory=given.folder)
    try:
        server = ThreadingHTTPServer(("127.0.0.1", given.port), handler)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or "ports go up to 65535"
        print(f"cannot serve at port {given.port} ({reason}); choose another with DEMO_PORT=...", file=sys.stderr)
        return 2
    print(f"http://localhost:{server.server_port}/ - stop with Ctrl-C", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
