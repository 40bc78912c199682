"""The Studio's page for a browser on this machine: static files, and one scene beside them."""

from __future__ import annotations

import http.server
import threading
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

__all__ = ["FOLDER", "PORT", "StudioServer", "studio_file"]

FOLDER = Path(__file__).parent / "studio_dist"
"""The built page; `make studio` makes it."""

PORT = 8087
"""The default port."""

SCENE = "/scene.iso.json"
"""Where the scene that is given lies beside the page."""


def studio_file(name: str) -> Path:
    """A file of the built page.

    Raises
    ------
    FileNotFoundError
        The page has not been built: this is a source tree.

    """
    path = FOLDER / name
    if not path.is_file():
        raise FileNotFoundError(f"the Studio has not been built, {path} is missing: run `make studio-page`")
    return path


class StudioServer:
    """Serves the Studio on the loopback interface until it is closed.

    Parameters
    ----------
    document : str, optional
        The text of an ``.iso.json`` file, with which the page begins.
    port : int
        0: any that is free.

    Raises
    ------
    FileNotFoundError
        The page has not been built.
    OSError
        The port is in use.

    """

    def __init__(self, document: str | None = None, *, port: int = PORT) -> None:
        studio_file("index.html")
        handler = partial(_Handler, document=document, directory=str(FOLDER))
        try:
            self._server = http.server.ThreadingHTTPServer(("127.0.0.1", port), handler)
        except OSError as error:
            raise OSError(error.errno, f"cannot listen on port {port}: {error.strerror}; try --port 0") from error
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, name="isoswarm studio", daemon=True)
        self._thread.start()
        self._has_scene = document is not None

    @property
    def url(self) -> str:
        """The address of the page."""
        begin = f"?model={SCENE[1:]}" if self._has_scene else ""
        return f"http://127.0.0.1:{self._server.server_address[1]}/{begin}"

    def wait(self) -> None:
        """Wait until it is interrupted (Ctrl-C) or closed."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """End it."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> StudioServer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Handler(http.server.SimpleHTTPRequestHandler):
    """Files of the page, and the scene."""

    protocol_version = "HTTP/1.1"
    extensions_map = {  # noqa: RUF012
        **http.server.SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".mjs": "text/javascript",
        ".wasm": "application/wasm",
        ".json": "application/json",
    }

    def __init__(self, *args: Any, document: str | None, **options: Any) -> None:
        self._document = document
        super().__init__(*args, **options)

    def do_GET(self) -> None:
        """Answer a browser of this machine only, by this machine's name."""
        host = self.headers.get("Host", "").rsplit(":", 1)[0]
        if host not in ("127.0.0.1", "localhost"):
            self.send_error(http.HTTPStatus.FORBIDDEN, "ask for 127.0.0.1")
        elif self.path == SCENE and self._document is not None:
            body = self._document.encode()
            self.send_response(http.HTTPStatus.OK)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)
        else:
            super().do_GET()

    def end_headers(self) -> None:
        """Isolated, so that commands can be cancelled between steps; not kept, so that a new version is seen."""
        self.send_header("Cross-Origin-Opener-Policy", "same-origin")
        self.send_header("Cross-Origin-Embedder-Policy", "require-corp")
        self.send_header("Cache-Control", "no-cache")
        super().end_headers()

    def list_directory(self, path: Any) -> None:  # noqa: ARG002
        """No lists of files."""
        self.send_error(http.HTTPStatus.NOT_FOUND)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing."""
