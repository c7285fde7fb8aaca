"""The server of the live page: this machine only, one random address, nothing that changes a file."""

from __future__ import annotations

import hmac
import json
import secrets
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import BoundedSemaphore, Event, Thread
from typing import Any

from rftfit.errors import InputError

HOST = "127.0.0.1"
_BEAT_S = 10.0
MOST_CONNECTIONS = 32
LONGEST_SILENCE_S = 10.0
"""After which a connection that asks for nothing ends."""
_POLICY = (
    "default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; connect-src 'self'; img-src data:; "
    "frame-ancestors 'none'; base-uri 'none'"
)


@dataclass(eq=False)
class Client:
    """A browser that looks at the page with its own query; it is sent the newest content only."""

    query: str
    content: str = ""
    content_ready: Event = field(default_factory=Event)
    is_new: bool = True


class LivePage(ThreadingHTTPServer):
    """The page of one campaign at `address`, which is another one after each start.

    A page that stays open after the end must not hand its token to whoever takes the port.
    """

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, port: int = 0) -> None:
        self.asked, self.clients, self.closed = Event(), list[Client](), False
        self._free = BoundedSemaphore(MOST_CONNECTIONS)
        try:
            super().__init__((HOST, port), _Handler)
        except OSError as error:
            raise InputError(
                f"--port: found {port}: {error.strerror or error}; allowed: a port that is free"
            ) from error
        self.token, self.port = secrets.token_hex(16), int(self.server_address[1])
        self.address = f"http://{HOST}:{self.port}/{self.token}/"
        Thread(target=self.serve_forever, daemon=True).start()

    def verify_request(self, *_: object) -> bool:
        """Take no more connections than a few browsers have: each is an open file."""
        return self._free.acquire(blocking=False)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer in a thread of its own, and give the place back."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def show(self, content: Callable[[str], str], *, changed: bool) -> None:
        """Send content by query to every browser, or to those alone that came meanwhile."""
        self.asked.clear()
        for client in [client for client in self.clients if changed or client.is_new]:
            client.content, client.is_new = content(client.query), False
            client.content_ready.set()

    def close(self) -> None:
        """End the server and what it still sends."""
        self.closed = True
        self.shutdown()
        self.server_close()
        for client in list(self.clients):
            client.content_ready.set()


class _Handler(BaseHTTPRequestHandler):
    server: LivePage
    timeout = LONGEST_SILENCE_S
    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        """Answer a request that names this host, comes from this page or from none, and has the token."""
        page_hosts = [f"{name}:{self.server.port}" for name in (HOST, "localhost")]
        _, token, page_and_query = [*self.path.split("/", 2), "", ""][:3]
        name, _, query = page_and_query.partition("?")
        is_ours = self.headers.get("Origin") in (None, *(f"http://{host}" for host in page_hosts))
        is_known = hmac.compare_digest(token.encode(), self.server.token.encode())
        if self.headers.get("Host") not in page_hosts or not is_ours or not is_known:
            self._head(403)
        elif name == "":
            nonce = secrets.token_hex(8)
            text = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
            page = text.replace("NONCE", nonce).encode()
            self._head(200, len(page), nonce=nonce)
            self.wfile.write(page)
        elif name == "events":
            self._send_events(query)
        else:
            self._head(404)

    def _head(
        self, status: int, size: int | None = 0, kind: str = "text/html", nonce: str = ""
    ) -> None:
        self.send_response(status)
        for key, value in {
            "Content-Type": f"{kind}; charset=utf-8",
            "Content-Security-Policy": _POLICY.format(nonce),
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Cross-Origin-Resource-Policy": "same-origin",
        }.items():
            self.send_header(key, value)
        if size is not None:
            self.send_header("Content-Length", str(size))
        self.end_headers()

    def _send_events(self, query: str) -> None:
        """Send content whenever there is new one, and a sign of life in between."""
        page, client = self.server, Client(query)
        self.close_connection = True
        self._head(200, None, "text/event-stream")
        page.clients.append(client)
        page.asked.set()
        with suppress(OSError):  # the browser has gone
            self.wfile.write(b"retry: 1000\n\n")
            while not page.closed:
                is_new = client.content_ready.wait(_BEAT_S)
                client.content_ready.clear()  # before the content is taken, so that newer content is sent too
                text = f"data: {json.dumps(client.content)}" if is_new else ": still here"
                self.wfile.write(f"{text}\n\n".encode())
        page.clients.remove(client)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing in the terminal."""
