"""The server of the live page: this machine only, one random address, nothing that changes a file."""

from __future__ import annotations

import hmac
import json
import os
import secrets
import tempfile
import threading
from collections import deque
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.store.digests import digest_of

if TYPE_CHECKING:
    from collections.abc import Callable

HOST = "127.0.0.1"
_BEAT_S = 10.0
_TOKEN_BYTES = 16


class Client:
    """A browser that looks at the page with its own query; it is sent the newest content only."""

    def __init__(self, query: str) -> None:
        self.query = query
        self.is_new = True
        self._content: deque[str] = deque(maxlen=1)
        self._there = threading.Event()

    def give(self, content: str) -> None:
        """Take content to be sent."""
        self.is_new = False
        self._content.append(content)
        self._there.set()

    def wait(self) -> str:
        """The newest content; empty where none came for some seconds."""
        self._there.wait(_BEAT_S)
        self._there.clear()
        return self._content.pop() if self._content else ""


class Page:
    """The page of one campaign at `address`, which stays the same after a restart where its port is free."""

    def __init__(self, root: Path, port: int = 0) -> None:
        self.asked = threading.Event()
        self.clients: list[Client] = []
        self.closed = False
        self.token, before = _kept(root)
        self.server = _bound(self, [port] if port else [before, 0])
        self.port: int = self.server.server_address[1]
        _keep(root, self.token, self.port)
        self.address = f"http://{HOST}:{self.port}/{self.token}/"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def show(self, content: Callable[[str], str], *, changed: bool) -> None:
        """Send content by query to every browser, or to those alone that came meanwhile."""
        self.asked.clear()
        for client in list(self.clients):
            if changed or client.is_new:
                client.give(content(client.query))

    def close(self) -> None:
        """End the server and what it still sends."""
        self.closed = True
        for client in list(self.clients):
            client.give("")
        self.server.shutdown()
        self.server.server_close()


def _file(root: Path) -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    base = Path(home) if home else Path.home() / ".cache"
    return base / "rftfit" / f"watch-{digest_of(str(root))}"


def _kept(root: Path) -> tuple[str, int]:
    """Token and port of the last watch of this campaign; a new token where there was none."""
    with suppress(OSError, ValueError):
        token, port = _file(root).read_text(encoding="ascii").split()
        if len(token) == 2 * _TOKEN_BYTES:
            return token, int(port)
    return secrets.token_hex(_TOKEN_BYTES), 0


def _keep(root: Path, token: str, port: int) -> None:
    """Remember them for this user alone; a page that reconnects finds its address again."""
    with suppress(OSError):
        path = _file(root)
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as file:  # mode 600
            file.write(f"{token} {port}")
        Path(file.name).replace(path)


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    page: Page


def _bound(page: Page, ports: list[int]) -> _Server:
    for port in ports:
        try:
            server = _Server((HOST, port), _Handler)
        except OSError:
            if port == ports[-1]:
                raise
            continue
        server.page = page
        return server
    raise AssertionError


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        """Answer a request that names this host, comes from this page or from none, and has the token."""
        page = self.server.page
        here = f"{HOST}:{page.port}", f"localhost:{page.port}"
        origin = self.headers.get("Origin")
        _, token, rest = [*self.path.split("/", 2), "", ""][:3]
        name, _, query = rest.partition("?")
        known = hmac.compare_digest(token.encode(), page.token.encode())
        if (
            self.headers.get("Host") not in here
            or (origin and origin not in {f"http://{one}" for one in here})
            or not known
        ):
            self._answer(403, "")
        elif name == "":
            nonce = secrets.token_hex(8)
            text = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
            self._answer(200, text.replace("NONCE", nonce), nonce)
        elif name == "events":
            self._events(query)
        else:
            self._answer(404, "")

    def _answer(self, status: int, text: str, nonce: str = "") -> None:
        data = text.encode()
        self.send_response(status)
        self._head("text/html; charset=utf-8", nonce)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def _head(self, kind: str, nonce: str = "") -> None:
        own = f"'nonce-{nonce}'"
        policy = f"default-src 'none'; script-src {own}; style-src {own}; connect-src 'self'; img-src data:"
        for key, value in {
            "Content-Type": kind, "Content-Security-Policy": f"{policy}; frame-ancestors 'none'; base-uri 'none'",
            "Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff",
            "Cross-Origin-Resource-Policy": "same-origin",
        }.items():  # fmt: skip
            self.send_header(key, value)

    def _events(self, query: str) -> None:
        page, client = self.server.page, Client(query)
        self.close_connection = True
        self.send_response(200)
        self._head("text/event-stream")
        self.end_headers()
        page.clients.append(client)
        page.asked.set()
        try:
            # a browser asks again a second after the program is gone
            self.wfile.write(b"retry: 1000\n\n")
            while not page.closed:
                content = client.wait()
                self.wfile.write(
                    f"data: {json.dumps(content)}\n\n".encode() if content else b": still here\n\n"
                )
                self.wfile.flush()
        except OSError:
            pass  # the browser has gone
        finally:
            page.clients.remove(client)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing in the terminal."""
